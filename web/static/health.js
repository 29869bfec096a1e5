// Health cards: the rig, the buses, the event log and the recording.

import { byId, create, setText, showRows } from "./elements.js";
import { formatCount, formatDuration, formatName } from "./format.js";

const NOT_CONFIGURED = "not configured";
const NOT_IN_REPLAY = "not available in a replay";
const BOARD_KINDS = ["real", "emulated", "simulated"];
const NO_SAMPLES = "no samples";
const LINK_LOST_S = 0.25; // the instrument trips if no sample arrives for this time
const ERROR_STATES = new Set(["down", "error", NO_SAMPLES]);

/** Counters of each section of HEALTH that are shown if they are not zero. */
export const COUNTERS = {
  rig: [
    "lost_frames",
    "repeated_frames",
    "implausible_frames",
    "damaged_bytes",
    "reconnects",
    "board_restarts",
  ],
  modbus_tcp: ["invalid_frames", "timeouts", "evicted", "not_allowed"],
  modbus_rtu: ["broadcasts", "other_units", "echoes"],
  can: ["dropped", "error_frames", "reopened"],
  rdt: ["dropped", "refused"],
};

const nonZeroCounters = (section, h) =>
  COUNTERS[section]
    .filter((name) => h[name])
    .map((name) => `${formatName(name)} ${formatCount(h[name])}`)
    .join(", ") || "none";

const rateAndTotal = (rate, total) => `${formatCount(rate)} per s, ${formatCount(total)} total`;

const FIRMWARE_REMARKS = {
  not_reported: " (no image reported)",
  other_version: " (another version than that of the host)",
  unknown: " (not a released image)",
};

const firmwareText = ({ firmware, firmware_origin }) =>
  `firmware ${firmware}${FIRMWARE_REMARKS[firmware_origin] ?? ""}`;

const boardText = (h) =>
  h.board === null
    ? "–"
    : `${BOARD_KINDS[h.board] ?? h.board}, ${firmwareText(h)}, no. ${h.serial}`;

/**
 * Section of HEALTH, title, and two functions: the state text, and the rows [name, text].
 * `rates` is also a section of HEALTH.
 */
const CARDS = [
  [
    "rig",
    "Rig",
    (h) => (h.phase !== "replay" && h.age_s > LINK_LOST_S ? NO_SAMPLES : formatName(h.phase)),
    (h, rates) => [
      ["port", h.url],
      ["board", boardText(h)],
      ["samples", rateAndTotal(rates.samples_per_s, h.samples)],
      ["age of the last sample", formatDuration(h.age_s)],
      ["errors", nonZeroCounters("rig", h)],
    ],
  ],
  [
    "modbus_tcp",
    "Modbus TCP",
    (h) => (h.clients.length === 1 ? "1 client" : `${h.clients.length} clients`),
    (h, rates) => [
      ["port", String(h.port)],
      ["requests", rateAndTotal(rates.modbus_requests_per_s, h.requests)],
      ["exceptions", rateAndTotal(rates.modbus_exceptions_per_s, h.exceptions)],
      ["errors", nonZeroCounters("modbus_tcp", h)],
    ],
  ],
  [
    "modbus_rtu",
    "Modbus RTU",
    (h) => (h.up ? "up" : "down"),
    (h) => [
      ["serial port", String(h.port)],
      ["requests", formatCount(h.requests)],
      ["exceptions", formatCount(h.exceptions)],
      ["other frames", nonZeroCounters("modbus_rtu", h)],
    ],
  ],
  [
    "can",
    "CAN",
    (h) => (h.up ? "up" : "down"),
    (h, rates) => [
      ["interface", h.at],
      ["node id", String(h.node_id)],
      ["stored parameters", h.stored_parameters],
      ["sent", rateAndTotal(rates.can_sent_per_s, h.sent)],
      ["received", rateAndTotal(rates.can_received_per_s, h.received)],
      ["errors", nonZeroCounters("can", h)],
    ],
  ],
  [
    "rdt",
    "RDT",
    (h) => (h.clients === 1 ? "1 client" : `${h.clients} clients`),
    (h, rates) => [
      ["UDP port", String(h.port)],
      ["records", rateAndTotal(rates.rdt_records_per_s, h.records)],
      ["errors", nonZeroCounters("rdt", h)],
    ],
  ],
  [
    "events",
    "Event log",
    (h) => (h.trouble ? "error" : "on"),
    (h) => [
      ["file", h.file],
      ["error", h.trouble || "none"],
    ],
  ],
  ["recording", "Recording", (h) => (h.on ? "on" : "off"), (h) => [["error", h.trouble || "none"]]],
];

/** Return HEALTH without the parts that a replay does not have: the rig, the event log and the recording. */
const withoutLiveParts = (health) => ({
  ...health,
  rig: { ...health.rig, phase: "replay" },
  events: null,
  recording: null,
});

/** Show HEALTH. A card has no numbers if HEALTH or the section of the card is null. */
export function showHealth(received, isReplay) {
  const health = received && isReplay ? withoutLiveParts(received) : received;
  const box = byId("health");
  if (!box.firstChild) box.append(...CARDS.map(createCard));
  CARDS.forEach(([section, , stateText, rows], index) => {
    const h = health?.[section];
    const absent = isReplay ? NOT_IN_REPLAY : NOT_CONFIGURED;
    const state = !health ? "not available" : h ? stateText(h) : absent;
    fillCard(box.children[index], state, h ? rows(h, health.rates ?? {}) : []);
  });
  showClients(health?.modbus_tcp?.clients ?? []);
}

function createCard([section, title]) {
  const card = create(
    "article",
    "card",
    create("h3", "", title),
    create("p", "card-state"),
    create("dl", "card-rows"),
  );
  if (section === "modbus_tcp") card.append(createClientTable());
  return card;
}

function fillCard(card, state, rows) {
  const [, stateElement, list] = card.children;
  setText(stateElement, state);
  stateElement.dataset.error = ERROR_STATES.has(state);
  while (list.children.length > rows.length) list.lastElementChild.remove();
  rows.forEach(([name, text], index) => {
    const row = list.children[index] ?? list.appendChild(create("div", "", create("dt"), create("dd")));
    setText(row.children[0], name);
    setText(row.children[1], text ?? "–");
  });
}

function createClientTable() {
  const headers = ["client", "per s", "requests", "exceptions", "age"].map((name) => {
    const header = create("th", "", name);
    header.scope = "col";
    return header;
  });
  const body = create("tbody");
  body.id = "clients";
  const table = create(
    "table",
    "",
    create("caption", "visually-hidden", "Modbus TCP clients"),
    create("thead", "", create("tr", "", ...headers)),
    body,
  );
  const box = create("div", "scroll small", table);
  box.hidden = true;
  box.tabIndex = 0;
  box.setAttribute("role", "region");
  box.setAttribute("aria-label", "Table of clients");
  return box;
}

function showClients(clients) {
  const body = byId("clients");
  body.closest(".scroll").hidden = clients.length === 0;
  showRows(
    body,
    clients.map((client) => [
      client.address,
      formatCount(client.requests_per_s),
      formatCount(client.requests),
      formatCount(client.exceptions),
      formatDuration(client.age_s),
    ]),
  );
}
