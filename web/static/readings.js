// Large readings: force with its expanded uncertainty, pressure, radius, setpoint and state.

import { byId, setText, showReading, showText } from "./elements.js";
import { attentionBits } from "./faults.js";
import { forceAlarmTexts } from "./force-alarm.js";
import { NOT_AVAILABLE, formatName, formatNumber } from "./format.js";
import { noForceReason } from "./no-force.js";
import { TOUCH_ONLY, isTouchState } from "./touch.js";

/** Id of the element, quantity of the state, decimals, unit, and unit in words for screen readers. */
const QUANTITIES = [
  ["pressure", "pressure_kpa", 2, "kPa", "kilopascals"],
  ["radius", "radius_mm", 2, "mm", "millimetres"],
  ["setpoint", "setpoint_kpa", 2, "kPa", "kilopascals"],
];

/** Show the numbers of a state; a state of null shows dashes. */
export function showReadings(state, info) {
  showForce(state, info);
  for (const [id, name, decimals, unit, unitWords] of QUANTITIES) {
    const number = formatNumber(state?.[name], decimals);
    showReading(
      byId(id),
      number,
      unit,
      number === NOT_AVAILABLE ? "not available" : `${number} ${unitWords}`,
    );
  }
  showState(state, info);
}

function showForce(state, info) {
  const { force_n, force_std_n, force_lower_range_limit_n, status = [] } = state ?? {};
  const [force, expanded] = [formatNumber(force_n, 2), formatNumber(2 * force_std_n, 2)];
  const isAvailable = force !== NOT_AVAILABLE;
  const sentence = isAvailable
    ? `${force} newtons, plus or minus ${expanded} newtons expanded uncertainty`
    : "not available";
  showReading(byId("force"), force, isAvailable ? `± ${expanded} N` : "N", sentence);
  showText(byId("force-missing"), isAvailable ? "" : noForceReason(state, info));
  showText(byId("force-above"), forceAlarmTexts(state).figure);
  const isTouch = isTouchState({ force_n, status });
  const touch = `Below ${formatNumber(force_lower_range_limit_n, 2)} N: ${TOUCH_ONLY}`;
  showText(byId("force-touch"), isTouch ? touch : "");
}

function showState(state, info) {
  const name = state ? formatName(state.state) : NOT_AVAILABLE;
  const isInContact = state?.status.includes("in_contact");
  const box = byId("state");
  box.dataset.state = state?.state ?? "";
  showReading(
    box,
    name,
    isInContact ? "in contact" : "",
    state ? `${name}${isInContact ? ", in contact" : ""}` : "not available",
  );
  const notZeroed = state?.status.includes("not_zeroed") ? ["not_zeroed"] : [];
  showText(byId("attention"), [...attentionBits(state), ...notZeroed].map(formatName).join(" · "));
  box.title = info.states[state?.state] ?? "";
}
