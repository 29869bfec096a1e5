// Reason why no force is available, in a few words.

const isHeld = ({ state }) => state === "holding";
const has = (name) => ({ status }) => status.includes(name);

/** Conditions without a force, the most important first: predicate, and text or function that returns it. */
const REASONS = [
  [has("stale"), "no current samples from the rig"],
  [({ state }) => state === "boot", "the rig has not answered yet"],
  [({ state, faults }) => state === "tripped" || faults.length > 0, "tripped: no force until faults are cleared"],
  [({ state }) => state === "vented", "vented: inflate to measure"],
  [({ state }) => state === "venting", "venting"],
  [(state) => !isHeld(state), "not inflated yet: wait"],
  [has("function_check"), "proof test: wait for up to 5 s"],
  [isSetpointOutside, (_, range_kpa) => `setpoint outside ${rangeText(range_kpa)}`],
  [(state) => has("out_of_range")(state) && has("force_high_alarm")(state), "the balloon may be pressed flat"],
  [has("out_of_range"), "outside the range of the model"],
  [has("baseline_old"), "baseline pressure unknown: lift off"],
];

/** Return why a state has no force, as words without a full stop. `state` is null without a connection. */
export function noForceReason(state, { force_range_kpa }) {
  if (!state) return "not connected";
  const text = REASONS.find(([applies]) => applies(state, force_range_kpa))?.[1] ?? "invalid reading";
  return typeof text === "string" ? text : text(state, force_range_kpa);
}

/** Return true if no force is measured at a setpoint. Without a range or a setpoint, return false. */
export const isOutside = (setpoint_kpa, range_kpa) =>
  Boolean(range_kpa) && (setpoint_kpa < range_kpa[0] || setpoint_kpa > range_kpa[1]);

/** Return the range of the pressures at which a force is measured as text. */
export const rangeText = ([low_kpa, high_kpa]) => `${low_kpa} to ${high_kpa} kPa`;

function isSetpointOutside(state, range_kpa) {
  return state.status.includes("out_of_range") && isOutside(state.setpoint_kpa ?? NaN, range_kpa);
}
