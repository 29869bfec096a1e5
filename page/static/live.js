// The stream of what the instrument shows, and whether it still comes.

import { Age } from "./age.js";

const OLD_S = 1;
const SILENT_MS = 2500; // an instrument that is up is heard each second
const PATIENCE_MS = 15000; // one that is down may be so for long, and so may a network
const LOOK_MS = 500;
const SILENT = "the page’s own server has fallen silent";
const NO_ANSWER = "the page’s own server does not answer";
const REFUSED = "the page’s own server lets no more pages look: close one";
const HIDDEN = "this page was out of view";

/**
 * Follows /api/live while the page is in view, for ever.
 *
 * A hidden page lets go of its stream: a browser keeps few connections to one host, and forgotten tabs would
 * hold up a vent. `handlers` has a function for each kind of event and `opened`, called as a stream begins;
 * `onLink({up, why, begun_s})` is called when the instrument can be seen as it is now, and when it no longer
 * can; `begun_s` is another where the instrument is.
 */
export function follow(handlers, onLink) {
  let stream = null;
  let heard_ms = 0;
  let up = false;
  let said = null;
  let served = { up: false }; // what the page’s server says of the instrument
  const age = new Age();

  const link = (isUp, why) => {
    if (isUp === up && why === said) return;
    up = isUp;
    said = why;
    onLink({ up, why, begun_s: served.begun_s });
  };

  const open = () => {
    heard_ms = performance.now();
    stream?.close();
    stream = new EventSource("/api/live");
    stream.onopen = handlers.opened;
    stream.onerror = () => link(false, stream.readyState === EventSource.CLOSED ? REFUSED : NO_ANSWER);
    listen("link", (told) => {
      served = told;
      age.begin(told.begun_s);
      if (!told.up) link(false, told.why);
    });
    listen("state", (state) => {
      if (served.up) judge(state);
      if (up) handlers.state(state);
    });
    for (const kind of ["samples", "history", "contacts", "health", "event"])
      listen(kind, (data) => (up || kind === "event") && handlers[kind](data));
  };

  /** What comes late is as good as nothing. */
  const judge = ({ t_s }) => {
    const age_s = age.of(t_s, performance.now() / 1e3);
    const isOld = age_s > OLD_S;
    link(!isOld, isOld ? `what comes is ${age_s.toFixed(0)} s old: the line is too slow` : "");
  };

  const listen = (kind, take) => {
    const mine = stream;
    mine.addEventListener(kind, ({ data }) => {
      if (mine !== stream) return;
      heard_ms = performance.now();
      take(JSON.parse(data));
    });
  };

  const patience_ms = () => (up || stream.readyState === EventSource.CLOSED ? SILENT_MS : PATIENCE_MS);

  const look = () => {
    if (document.hidden || (stream && performance.now() - heard_ms < patience_ms())) return;
    if (up) link(false, SILENT);
    open();
  };

  document.addEventListener("visibilitychange", () => {
    if (!document.hidden) return look();
    stream?.close();
    stream = null;
    link(false, HIDDEN);
  });
  setInterval(look, LOOK_MS);
  look();
}
