// The page: what comes from the instrument goes to the parts that show it.

import { showAccess, startAccess } from "./access.js";
import { showContacts } from "./contacts.js";
import { Controls } from "./controls.js";
import { announce, byId, say } from "./elements.js";
import { clearEvents, showEvent } from "./events.js";
import { showFaults } from "./faults.js";
import { showFigures } from "./figures.js";
import { showHealth } from "./health.js";
import { describeRegisters, startInspector } from "./inspector.js";
import { follow } from "./live.js";
import { clock } from "./numbers.js";
import { UNKNOWN, fetchAbout } from "./requests.js";
import { Speech } from "./speech.js";
import { Token } from "./token.js";

const DESCRIBED_MS = 2000;
const AGAIN_MS = 1000;

const world = { link: { up: false, why: "" }, about: UNKNOWN, state: null };
let lostSince = new Date();
let contacts = [];

const plots = await curves();
const speech = new Speech(byId("speech"));
const token = new Token(() => refresh());
world.token = token;
const controls = new Controls(() => world);

/** The plots; null where what draws them was not installed: then all else is shown. */
async function curves() {
  try {
    const { Plots } = await import("./plots.js");
    return new Plots(byId("force-plot"), byId("pressure-plot"));
  } catch {
    announce(byId("no-plots"), "No curves: uPlot, which draws them, is not installed here (make vendor).");
    return null;
  }
}

function refresh() {
  const { link, about, state } = world;
  showFigures(state, about);
  showFaults(state, about);
  speech.hear(state, about);
  showAccess(token, about, link.up);
  showContacts(contacts, state?.t_s ?? NaN);
  announce(byId("simulated"), sourceWords(about, state));
  controls.update();
  document.dispatchEvent(new CustomEvent("instrument-state", { detail: state }));
}

function sourceWords({ replay, simulated }, state) {
  if (replay) return `REPLAY of ${replay}: this is the past`;
  return simulated || state?.status.includes("simulated") ? "SIMULATED: this is no real rig" : "";
}

function showLink({ up, why }) {
  if (world.link.up && !up) lostSince = new Date();
  if (!world.link.up && up) {
    describe(); // it may be another
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
    world.about = await fetchAbout();
  } catch {
    return void setTimeout(describe, AGAIN_MS);
  }
  const { about } = world;
  describeRegisters(about);
  document.body.classList.toggle("replay", Boolean(about.replay));
  say(byId("serial"), about.serial_number ? `no. ${about.serial_number}` : "");
  const [map, configuration] = [about.map_hash, about.configuration_hash].map(hex8);
  say(
    byId("identity"),
    `Version ${about.version}, map ${about.map_version} (${map}), configuration ${configuration}`,
  );
  refresh();
}

const hex8 = (hash) => (typeof hash === "number" ? hash.toString(16).toUpperCase().padStart(8, "0") : hash);

const handlers = {
  opened: clearEvents, // they come anew
  samples: (batch) => plots?.samples(batch),
  state: (state) => {
    world.state = state;
    refresh();
  },
  contacts: ({ rows }) => {
    contacts = rows;
    plots?.contacts(rows);
    showContacts(rows, world.state?.t_s ?? NaN);
  },
  health: showHealth,
  event: showEvent,
};

for (const choice of document.querySelectorAll("input[name=span]")) {
  choice.addEventListener("change", () => plots?.span(Number(choice.value)));
  if (choice.checked) plots?.span(Number(choice.value)); // a reload keeps what was chosen
}
new IntersectionObserver((entries) => {
  byId("mini").hidden = entries.at(-1).isIntersecting; // the numbers in short, once the large ones are out of view
}).observe(byId("figures"));
setInterval(() => plots?.describe(byId("force-plot"), byId("pressure-plot")), DESCRIBED_MS);
startAccess(token);
startInspector();
token.begin();
follow(handlers, showLink);
