// The large numbers: force with its uncertainty, pressure, radius, setpoint, state.

import { announce, byId, say, showFigure } from "./elements.js";
import { wantingOf } from "./faults.js";
import { NOT_AVAILABLE, shown, spoken } from "./numbers.js";

const QUANTITIES = [
  ["pressure", "pressure_kpa", 2, "kPa", "kilopascals"],
  ["radius", "radius_mm", 2, "mm", "millimetres"],
  ["setpoint", "setpoint_kpa", 2, "kPa", "kilopascals"],
];

/** Show the state's numbers; null shows dashes. */
export function showFigures(state, about) {
  showForce(state ?? {});
  for (const [id, name, digits, unit, words] of QUANTITIES) {
    const number = shown(state?.[name], digits);
    showFigure(byId(id), number, unit, number === NOT_AVAILABLE ? "not available" : `${number} ${words}`);
  }
  showState(state, about);
}

function showForce({ force_n, force_std_n, force_limit_n, status = [] }) {
  const [force, u] = [shown(force_n, 2), shown(force_std_n, 2)];
  const known = force !== NOT_AVAILABLE;
  const words = known ? `${force} newtons, plus or minus ${u} newtons standard uncertainty` : "not available";
  const above = status.includes("force_limit") ? `above the limit of ${shown(force_limit_n, 2)} N` : "";
  showFigure(byId("force"), force, known ? `± ${u} N` : "N", words);
  announce(byId("force-above"), above);
  announce(byId("force-limit"), above && `FORCE ${above}: stop pushing, back off.`);
}

function showState(state, about) {
  const name = state ? spoken(state.state) : NOT_AVAILABLE;
  const touched = state?.status.includes("in_contact");
  const box = byId("state");
  box.dataset.state = state?.state ?? "";
  showFigure(
    box,
    name,
    touched ? "in contact" : "",
    state ? `${name}${touched ? ", in contact" : ""}` : "not available",
  );
  announce(byId("wanting"), wantingOf(state).map(spoken).join(" · "));
  box.title = about.states[state?.state] ?? "";
  document.title = state ? `${name} · pneuforce` : "not connected · pneuforce";
  say(
    byId("mini"),
    state ? `${shown(state.force_n, 2)} N   ${shown(state.pressure_kpa, 2)} kPa   ${name}` : NOT_AVAILABLE,
  );
}
