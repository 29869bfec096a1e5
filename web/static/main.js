// Entry point of the page: distributes the messages of the event stream to the panels.

import { Announcer } from "./announcements.js";
import { mergeContacts, showContacts } from "./contacts.js";
import { Controls } from "./controls.js";
import { byId, setText, showText } from "./elements.js";
import { followEventStream } from "./event-stream.js";
import { showEvent, showEvents } from "./events.js";
import { showFaults } from "./faults.js";
import { NOT_AVAILABLE } from "./format.js";
import { showHealth } from "./health.js";
import { setRegisters, startInspector } from "./inspector.js";
import { showLogin, startLogin } from "./login.js";
import { AlarmOffDelay } from "./off-delay.js";
import { titleText } from "./page-title.js";
import { showLimits, startPlotPanel } from "./plot-panel.js";
import { showReadings } from "./readings.js";
import { RecordingPanel } from "./recording.js";
import { UNKNOWN_INFO, get } from "./requests.js";
import { Session } from "./session.js";
import { showStateBar, showSummaryWithoutFigures } from "./state-bar.js";

const RETRY_MS = 1000;
const INFO_TIMEOUT_MS = 15000; // 9 kB, which compete with the values on a slow network

const model = { link: { up: false, reason: "", since: new Date() }, info: UNKNOWN_INFO, state: null };
let contacts = [];
let infoOf = null; // start time of the instrument whose info was loaded

const plots = await startPlotPanel(() => model.info);
const announcer = new Announcer(byId("announcements"), byId("alarm-announcements"));
const offDelay = new AlarmOffDelay();
const session = new Session(() => refresh());
model.session = session;
const controls = new Controls(() => model);
const recordingPanel = new RecordingPanel(() => model);

function refresh() {
  const { link, info, state } = model;
  showStateBar(model);
  showReadings(state, info);
  showLimits(plots, state);
  showFaults(state, info);
  announcer.update(state, info);
  showLogin(session);
  showContacts(contacts, state);
  showText(byId("simulated"), sourceText(info, state));
  document.body.classList.toggle("stale", state?.status.includes("stale") ?? false);
  controls.update();
  recordingPanel.update();
  document.dispatchEvent(new CustomEvent("instrument-state", { detail: state }));
  showTitle();
}

const showTitle = () =>
  setText(document.querySelector("title"), titleText(model, byId("vent-failed").textContent));

function sourceText({ replay, simulated }, state) {
  if (replay) return `REPLAY of ${replay}: not live`;
  return simulated || state?.status.includes("simulated") ? "SIMULATED: no real rig" : "";
}

function showLink({ up, reason, started_s, utc_offset_s }) {
  if (up) plots?.setClock(utc_offset_s);
  if (up && started_s !== infoOf) {
    infoOf = started_s;
    loadInfo();
    session.update();
  }
  model.link = { up, reason, since: model.link.up ? new Date() : model.link.since };
  if (!up) {
    model.state = null;
    showHealth(null);
  }
  document.body.classList.toggle("disconnected", !up);
  refresh();
}

/** Return who has signed the configuration and the calibration, or why a signature is not accepted. */
function signatures(info) {
  return Object.entries(info.signatures ?? {})
    .map(([file, signature]) => `; signature of the ${file}: ${signature}`)
    .join("");
}

/** Load the facts about the instrument, and retry until the request succeeds. Codes have no texts until then. */
async function loadInfo() {
  try {
    model.info = await get("/api/about", INFO_TIMEOUT_MS);
  } catch {
    return void setTimeout(loadInfo, RETRY_MS);
  }
  const { info } = model;
  setRegisters(info);
  document.body.classList.toggle("replay", Boolean(info.replay));
  setText(byId("serial"), info.serial_number ? `no. ${info.serial_number}` : "");
  const map = `register map ${info.map_version} (${info.map_hash})`;
  setText(
    byId("identity"),
    `Version ${info.version}, ${map}, configuration ${info.configuration_hash ?? NOT_AVAILABLE}${signatures(info)}`,
  );
  refresh();
}

const handlers = {
  samples: (batch) => plots?.addSamples(batch),
  state: (state) => {
    model.state = offDelay.apply(state);
    plots?.setTime(state.t_s);
    refresh();
  },
  history: (batch) => plots?.addHistory(batch),
  contacts: ({ rows }) => {
    contacts = mergeContacts(contacts, rows);
    plots?.setContacts(contacts);
    showContacts(contacts, model.state);
  },
  health: (health) => showHealth(health, Boolean(model.info.replay)),
  events: showEvents,
  event: showEvent,
  recording: (recording) => recordingPanel.show(recording),
};

showSummaryWithoutFigures();
startLogin(session);
startInspector();
followEventStream(handlers, showLink);
// A vent also fails while no message arrives.
new MutationObserver(showTitle).observe(byId("vent-failed"), { childList: true });
