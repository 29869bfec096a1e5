// What may be asked for now, and why not, in a sentence. The instrument decides; this spares vain tries.

import { spoken } from "./numbers.js";

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
      `Another holds the lease (${spoken(state.lease_holder)}): it may only be vented from here.`,
  ],
  [({ state }) => !state.status.includes("write_lock"), () => "The configuration locks writes."],
];
const isUntripped = ({ state }) => !state.faults.length && state.state !== "tripped";
const VENTED = [({ state }) => state.state === "vented", () => "Vent first: only a vented balloon."];

/** Action → conditions beside those that hold for all, each with its sentence. */
const CONDITIONS = {
  setpoint: [],
  hold: [
    [isUntripped, () => "Tripped: clear the faults first, then vent."],
    [({ state }) => state.mode !== "hold", () => "Told to hold already. Vent first, to inflate anew."],
    [
      ({ arming }) => !arming.isVentDue,
      () => "Vent first: a vent from here comes before anything is inflated.",
    ],
    [({ state }) => Number.isFinite(state.setpoint_requested_kpa), () => "Set a setpoint first."],
    VENTED,
    [({ state }) => !state.status.includes("not_zeroed"), () => "The pressure sensor has no zero yet."],
  ],
  clear: [[(world) => !isUntripped(world), () => "No fault is latched."]],
  zero: [[isUntripped, () => "Tripped: clear the faults first."], VENTED],
};

/** Why an action cannot be asked for now; "" where it can. `world` has link, about, token, arming and state. */
export function whyNot(action, world) {
  const failing = [...ANYBODY, ...CONDITIONS[action]].find(([holds]) => !holds(world));
  return failing ? failing[1](world) : "";
}
