// What may be asked for now, and the sentence that says why not. The instrument decides; this spares vain tries.

const ANYBODY = [
  [({ link, state }) => link.up && state, () => "Not connected to the instrument."],
  [({ about }) => about.writable !== undefined, () => "It is not known yet what may be written."],
  [
    ({ about }) => about.writable,
    () => "No operator’s token is configured: this page only looks, and vents.",
  ],
  [
    ({ token }) => token.value,
    ({ token }) =>
      token.stale ? "The token is no longer valid: log in again." : "Log in with the operator’s token first.",
  ],
  [
    ({ state }) => ["none", "page"].includes(state.lease_holder),
    ({ state }) =>
      `Another holds the lease (${state.lease_holder.replaceAll("_", " ")}): it may only be vented from here.`,
  ],
  [({ state }) => !state.status.includes("write_lock"), () => "The configuration locks writes."],
];
const VENTED = [({ state }) => state.state === "vented", () => "Vent first: only a vented balloon."];

/** Action → conditions beside those that hold for all, each with its sentence. */
const CONDITIONS = {
  setpoint: [],
  hold: [
    [
      ({ state }) => !state.faults.length && state.state !== "tripped",
      () => "Tripped: clear the faults first, then vent.",
    ],
    [({ state }) => state.mode !== "hold", () => "Told to hold already. Vent first, to inflate anew."],
    [({ state }) => Number.isFinite(state.setpoint_requested_kpa), () => "Set a setpoint first."],
    VENTED,
    [({ state }) => !state.status.includes("not_zeroed"), () => "The pressure sensor has no zero yet."],
  ],
  clear: [[({ state }) => state.faults.length || state.state === "tripped", () => "No fault is latched."]],
  zero: [VENTED],
};

/** Why an action cannot be asked for now; "" where it can. `world` has link, about, token and state. */
export function whyNot(action, world) {
  const failing = [...ANYBODY, ...CONDITIONS[action]].find(([holds]) => !holds(world));
  return failing ? failing[1](world) : "";
}
