// Connection to the event stream of the web server, with detection of old and missing data.

import { AgeEstimator } from "./age.js";

const MAX_AGE_S = 1;
const SILENT_MS = 2500; // an instrument that is up sends several messages per second
const DISCONNECTED_SILENT_MS = 15000; // without an instrument the server sends a comment each 10 s
const CHECK_PERIOD_MS = 500;
const SERVER_SILENT = "The web server sends nothing.";
const SERVER_UNREACHABLE = "The web server does not answer.";
const SERVER_FULL = "Too many browsers are connected. Close one of them.";
const TICKER = "/static/ticker.js";

/** Reason of the link while a hidden page has no stream. */
export const PAGE_HIDDEN = "This page was hidden.";

/**
 * Follow /api/live.
 *
 * A hidden page keeps its stream for the title of its tab, until another tab opens a stream. A browser opens only
 * a few connections to one host, so the streams of many hidden tabs could delay a vent.
 *
 * `handlers` has a function for each type of message.
 * `onLink({up, reason, started_s, utc_offset_s})` is called when current data of the instrument becomes available
 * or unavailable. `started_s` differs after a restart of the instrument. `utc_offset_s` is the time of day of the
 * host minus the time of its samples [s].
 */
export function followEventStream(handlers, onLink) {
  let stream = null;
  let received_ms = 0;
  let isUp = false;
  let shownReason = null;
  let isReplaced = false; // another tab has opened a stream since this tab has
  let serverLink = { up: false }; // the link between the web server and the instrument
  const ageEstimator = new AgeEstimator();
  const otherTabs = new BroadcastChannel("pneuforce-stream");

  const setLink = (up, reason) => {
    if (up === isUp && reason === shownReason) return;
    isUp = up;
    shownReason = reason;
    const { started_s, utc_offset_s } = serverLink;
    onLink({ up, reason, started_s, utc_offset_s });
  };

  const open = () => {
    received_ms = performance.now();
    isReplaced = false;
    otherTabs.postMessage("opened");
    stream?.close();
    stream = new EventSource("/api/live");
    stream.onerror = () =>
      setLink(false, stream.readyState === EventSource.CLOSED ? SERVER_FULL : SERVER_UNREACHABLE);
    listen("link", (link) => {
      serverLink = link;
      ageEstimator.start(link.started_s);
      if (!link.up) setLink(false, link.reason);
    });
    listen("state", (state) => {
      if (serverLink.up) checkAge(state);
      if (isUp) handlers.state(state);
    });
    for (const type of ["samples", "history", "health"])
      listen(type, (data) => isUp && handlers[type](data));
    // Each row of the contacts is sent once, so no message may be dropped while the values are late.
    for (const type of ["contacts", "events", "event", "recording"]) listen(type, (data) => handlers[type](data));
  };

  /** Treat the instrument as disconnected if its data arrives too late. */
  const checkAge = ({ t_s }) => {
    const age_s = ageEstimator.age(t_s, performance.now() / 1e3);
    const isOld = age_s > MAX_AGE_S;
    setLink(!isOld, isOld ? `The values are ${age_s.toFixed(0)} s old: the network is too slow.` : "");
  };

  const listen = (type, handle) => {
    const source = stream;
    source.addEventListener(type, ({ data }) => {
      if (source !== stream) return;
      received_ms = performance.now();
      handle(JSON.parse(data));
    });
  };

  const timeout_ms = () =>
    isUp || stream.readyState === EventSource.CLOSED ? SILENT_MS : DISCONNECTED_SILENT_MS;

  const check = () => {
    if (stream ? performance.now() - received_ms < timeout_ms() : document.hidden) return;
    if (isUp) setLink(false, SERVER_SILENT);
    open();
  };

  const pause = () => {
    stream?.close();
    stream = null;
    setLink(false, PAGE_HIDDEN);
  };

  otherTabs.onmessage = () => {
    isReplaced = true;
    if (document.hidden) pause();
  };
  document.addEventListener("visibilitychange", () => {
    if (!document.hidden) check();
    else if (isReplaced) pause();
  });
  document.addEventListener("freeze", pause); // the browser stops a hidden page, which could keep an old title
  setInterval(check, CHECK_PERIOD_MS);
  new Worker(TICKER).onmessage = check; // browsers slow down the timers of a hidden page, but not of a worker
  check();
}
