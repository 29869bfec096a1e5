// How the rig, the buses and the files are doing.

import { byId, make, say, showRows } from "./elements.js";
import { counted, lasting, spoken } from "./numbers.js";

const NONE = "not configured";
const NOT_REPLAYED = "not in a replay";
const BOARDS = ["real", "emulated", "simulated"];
const trouble = (h, ...names) =>
  names
    .filter((name) => h[name])
    .map((name) => `${spoken(name)} ${counted(h[name])}`)
    .join(", ") || "none";

/** Part of HEALTH → title, verdict, and lines [name, text]; `rates` are those of the whole. */
const CARDS = [
  [
    "rig",
    "Rig",
    (h) => spoken(h.phase),
    (h, rates) => [
      ["at", h.url],
      [
        "board",
        h.board === null
          ? "–"
          : `${BOARDS[h.board] ?? h.board}, firmware ${h.firmware >> 8}.${h.firmware & 0xff}, no. ${h.serial}`,
      ],
      ["samples", `${counted(rates.samples_per_s)} per s, ${counted(h.samples)} in all`],
      ["age of the last", lasting(h.age_s)],
      [
        "errors",
        trouble(
          h,
          "lost_frames",
          "repeated_frames",
          "implausible_frames",
          "damaged_bytes",
          "reconnects",
          "board_restarts",
        ),
      ],
    ],
  ],
  [
    "modbus_tcp",
    "Modbus TCP",
    (h) => (h.clients.length === 1 ? "1 client" : `${h.clients.length} clients`),
    (h, rates) => [
      ["port", String(h.port)],
      ["requests", `${counted(rates.modbus_requests_per_s)} per s, ${counted(h.requests)} in all`],
      ["exceptions", `${counted(rates.modbus_exceptions_per_s)} per s, ${counted(h.exceptions)} in all`],
      ["errors", trouble(h, "refused_frames", "timeouts", "evicted", "foreign")],
    ],
  ],
  [
    "modbus_rtu",
    "Modbus RTU",
    (h) => (h.up ? "up" : "down"),
    (h) => [
      ["line", String(h.port)],
      ["requests", counted(h.requests)],
      ["exceptions", counted(h.exceptions)],
      ["beside", trouble(h, "broadcasts", "others", "echoes")],
    ],
  ],
  [
    "can",
    "CAN",
    (h) => (h.up ? "up" : "down"),
    (h, rates) => [
      ["at", h.at],
      ["sent", `${counted(rates.can_sent_per_s)} per s, ${counted(h.sent)} in all`],
      ["received", `${counted(rates.can_received_per_s)} per s, ${counted(h.received)} in all`],
      ["errors", trouble(h, "dropped", "error_frames", "reopened")],
    ],
  ],
  [
    "events",
    "Event log",
    (h) => (h.trouble ? "in trouble" : "kept"),
    (h) => [
      ["file", h.file],
      ["trouble", h.trouble || "none"],
    ],
  ],
  ["recording", "Recording", (h) => (h.on ? "on" : "off"), (h) => [["trouble", h.trouble || "none"]]],
];
const BAD = new Set(["down", "in trouble"]);

/** Of a replay there is no rig, and no log is kept. */
const replayed = (health) => ({
  ...health,
  rig: { ...health.rig, phase: "replay" },
  events: null,
  recording: null,
});

/** Show HEALTH; null, and parts that are null, show no numbers. */
export function showHealth(told, isReplay) {
  const health = told && isReplay ? replayed(told) : told;
  const box = byId("health");
  if (!box.firstChild) box.append(...CARDS.map(card));
  CARDS.forEach(([part, , verdict, lines], at) => {
    const h = health?.[part];
    const said = !health ? "not available" : h ? verdict(h) : isReplay ? NOT_REPLAYED : NONE;
    fill(box.children[at], said, h ? lines(h, health.rates ?? {}) : []);
  });
  showClients(health?.modbus_tcp?.clients ?? []);
}

function card([part, title]) {
  const made = make("article", "card", make("h3", "", title), make("p", "verdict"), make("dl", "lines"));
  if (part === "modbus_tcp") made.append(clientTable());
  return made;
}

function fill(card, verdict, lines) {
  const [, said, list] = card.children;
  say(said, verdict);
  said.dataset.bad = BAD.has(verdict);
  while (list.children.length > lines.length) list.lastElementChild.remove();
  lines.forEach(([name, text], at) => {
    const line = list.children[at] ?? list.appendChild(make("div", "", make("dt"), make("dd")));
    say(line.children[0], name);
    say(line.children[1], text ?? "–");
  });
}

function clientTable() {
  const heads = ["client", "per s", "requests", "exceptions", "age"].map((name) => {
    const head = make("th", "", name);
    head.scope = "col";
    return head;
  });
  const body = make("tbody");
  body.id = "clients";
  const table = make(
    "table",
    "",
    make("caption", "unseen", "Clients of Modbus TCP"),
    make("thead", "", make("tr", "", ...heads)),
    body,
  );
  const box = make("div", "scroll small", table);
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
    clients.map((c) => [
      c.address,
      counted(c.requests_per_s),
      counted(c.requests),
      counted(c.exceptions),
      lasting(c.age_s),
    ]),
  );
}
