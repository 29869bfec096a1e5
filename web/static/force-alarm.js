// Reason of the force alarm. The alarm has two conditions: the force limit, and the rise of the pressure.

import { formatNumber } from "./format.js";

/** Rise of the pressure [kPa] above which the force can be higher than the model shows. */
const ALARM_RISE_KPA = 6;

/** Return true if the force of a state is above its alarm limit. */
const isAbove = ({ force_n, force_limit_n }) => force_n > force_limit_n;

/** Return the reason of the force alarm in a few words; "" without an alarm. */
export function forceAlarmReason(state) {
  if (!state?.status.includes("force_high_alarm")) return "";
  const limit = `${formatNumber(state.force_limit_n, 2)} N`;
  if (isAbove(state)) return `force above ${limit}`;
  if (state.rise_kpa > ALARM_RISE_KPA) return `pressure rise above ${ALARM_RISE_KPA} kPa`;
  const isNear = state.force_n > state.force_limit_n - state.alarm_hysteresis_n;
  return isNear ? `force near the limit of ${limit}` : "force alarm ends";
}

/** Return the force alarm as sentences for the bar; "" without an alarm. */
export function forceAlarmText(state) {
  const reason = forceAlarmReason(state);
  if (!reason) return "";
  const sentence = reason[0].toUpperCase() + reason.slice(1);
  if (reason === "force alarm ends") return `${sentence}.`;
  return sentence.startsWith("Pressure")
    ? `${sentence}: the force can be higher than shown. Back off.`
    : `${sentence}. Back off.`;
}

/** Return the reason for the field of the force; "" if the shown force is below the limit and the rise is small. */
export function forceAlarmNote(state) {
  const reason = forceAlarmReason(state);
  return /above/.test(reason) ? reason[0].toUpperCase() + reason.slice(1) : "";
}
