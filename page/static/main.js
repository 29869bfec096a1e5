// The page: what comes from the instrument goes to the parts that show it.

import { showAccess, startAccess } from "./access.js";
import { showContacts, updated } from "./contacts.js";
import { Controls } from "./controls.js";
import { announce, byId, say } from "./elements.js";
import { clearEvents, showEvent } from "./events.js";
import { showFaults } from "./faults.js";
import { showFigures } from "./figures.js";
import { showHealth } from "./health.js";
import { describeRegisters, startInspector } from "./inspector.js";
import { follow } from "./live.js";
import { NOT_AVAILABLE, clock } from "./numbers.js";
import { UNKNOWN, get } from "./requests.js";
import { Speech } from "./speech.js";
import { Token } from "./token.js";

const DESCRIBED_MS = 2000;
const AGAIN_MS = 1000;

const world = { link: { up: false, why: "" }, about: UNKNOWN, state: null };
let lostSince = new Date();
let contacts = [];
let described = null; // which instrument

const plots = await curves();
const speech = new Speech(byId("speech"), byId("speech-of-alarms"));
const token = new Token(() => refresh());
world.token = token;
const controls = new Controls(() => world);

/** The plots; null where what draws them was not installed: then all else is shown. */
async function curves() {
  const drawing = await import("./plots.js").catch(() => null);
  if (drawing) return new drawing.Plots(byId("force-plot"), byId("pressure-plot"));
  announce(byId("no-plots"), "No curves: uPlot, which draws them, is not installed here (make vendor).");
  return null;
}

function refresh() {
  const { link, about, state } = world;
  showFigures(state, about);
  showFaults(state, about);
  speech.hear(state, about);
  showAccess(token, about, link.up);
  showContacts(contacts, state?.t_s ?? NaN);
  announce(byId("simulated"), sourceWords(about, state));
  document.body.classList.toggle("stale", state?.status.includes("stale") ?? false);
  controls.update();
  document.dispatchEvent(new CustomEvent("instrument-state", { detail: state }));
}

function sourceWords({ replay, simulated }, state) {
  if (replay) return `REPLAY of ${replay}: this is the past`;
  return simulated || state?.status.includes("simulated") ? "SIMULATED: this is no real rig" : "";
}

function showLink({ up, why, begun_s }) {
  if (world.link.up && !up) lostSince = new Date();
  if (up && begun_s !== described) {
    described = begun_s;
    describe();
    token.recheck();
  }
  world.link = { up, why };
  if (!up) {
    world.state = null;
    showHealth(null);
  }
  document.body.classList.toggle("lost", !up);
  byId("link").dataset.link = up ? "up" : "down";
  say(byId("link"), up ? "connected" : "not connected");
  announce(byId("lost"), up ? "" : `NOT CONNECTED since ${clock(lostSince)}${why ? `: ${why}` : ""}`);
  refresh();
}

/** Ask what the instrument is until it is known: codes are shown by their names until then. */
async function describe() {
  try {
    world.about = await get("/api/about");
  } catch {
    return void setTimeout(describe, AGAIN_MS);
  }
  const { about } = world;
  describeRegisters(about);
  document.body.classList.toggle("replay", Boolean(about.replay));
  say(byId("serial"), about.serial_number ? `no. ${about.serial_number}` : "");
  const map = `map ${about.map_version} (${about.map_hash})`;
  say(
    byId("identity"),
    `Version ${about.version}, ${map}, configuration ${about.configuration_hash ?? NOT_AVAILABLE}`,
  );
  refresh();
}

const handlers = {
  opened: clearEvents, // they come anew
  samples: (batch) => plots?.samples(batch),
  state: (state) => {
    world.state = state;
    plots?.clock(state.t_s);
    refresh();
  },
  history: (batch) => plots?.history(batch),
  contacts: ({ rows }) => {
    contacts = updated(contacts, rows);
    plots?.contacts(contacts);
    showContacts(contacts, world.state?.t_s ?? NaN);
  },
  health: (health) => showHealth(health, Boolean(world.about.replay)),
  event: showEvent,
};

for (const choice of document.querySelectorAll("input[name=span]")) {
  choice.addEventListener("change", () => plots?.span(Number(choice.value)));
  if (choice.checked) plots?.span(Number(choice.value)); // a reload keeps what was chosen
}
const atTop = { rootMargin: `-${document.querySelector(".bar").offsetHeight}px 0px 0px`, threshold: 1 };
new IntersectionObserver((entries) => {
  byId("mini").hidden = entries.at(-1).isIntersecting; // in short what is not in view in large
}, atTop).observe(byId("force"));
setInterval(() => plots?.describe(), DESCRIBED_MS);
startAccess(token);
startInspector();
token.begin();
follow(handlers, showLink);
