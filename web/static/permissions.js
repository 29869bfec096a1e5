// Check whether an action is possible now. The instrument decides; this check avoids useless requests.

import { formatName } from "./format.js";

const isUntripped = ({ state }) => !state.faults.length && state.state !== "tripped";

/** Conditions of all actions: code, predicate, and the text if the predicate is false. */
const COMMON = [
  ["disconnected", ({ link, state }) => link.up && state, () => "Not connected to the instrument."],
  [
    "loading",
    ({ info }) => info.writable !== undefined,
    () => "The data of the instrument is still loading. Please wait.",
  ],
  [
    "no_token_configured",
    ({ info }) => info.writable,
    () => "No operator’s token is configured. This page can only show values and vent.",
  ],
  [
    "token_expired",
    ({ token }) => token.value || !token.isExpired,
    () => "The operator’s token is no longer valid. Log in again.",
  ],
  ["logged_out", ({ token }) => token.value, () => "Log in with the operator’s token first."],
  [
    "lease",
    ({ state }) => ["none", "web"].includes(state.lease_holder),
    ({ state }) => `The lease is held by ${formatName(state.lease_holder)}. This page can only vent.`,
  ],
  [
    "write_protect",
    ({ state }) => !state.status.includes("write_protect"),
    () => "The configuration disables writing. VENT still works.",
  ],
];

const VENTED = [
  "not_vented",
  ({ state }) => state.state === "vented",
  () => "The balloon is not vented. Vent first.",
];

/** Action → further conditions. */
const CONDITIONS = {
  setpoint: [],
  hold: [
    ["tripped", isUntripped, () => "The rig is tripped. Clear the faults first, then vent."],
    [
      "holding",
      ({ state }) => state.mode !== "hold",
      () => "The mode is already hold. Vent first to inflate again.",
    ],
    [
      "vent_due",
      ({ arming }) => !arming.isVentDue,
      () => "Vent first. Each inflation needs a vent from this page before it.",
    ],
    [
      "no_setpoint",
      ({ state }) => Number.isFinite(state.setpoint_requested_kpa),
      () => "Set a setpoint first.",
    ],
    VENTED,
    [
      "not_zeroed",
      ({ state }) => !state.status.includes("not_zeroed"),
      () => "The pressure sensor is not zeroed yet.",
    ],
  ],
  clear: [["no_fault", (model) => !isUntripped(model), () => "No fault is latched."]],
  zero: [["tripped", isUntripped, () => "The rig is tripped. Clear the faults first."], VENTED],
};

/**
 * Return {code, text} of the first condition that blocks an action; null if the action is possible.
 *
 * `model` has link, info, token, arming and state.
 */
export function blockedBy(action, model) {
  const blocking = [...COMMON, ...CONDITIONS[action]].find(([, holds]) => !holds(model));
  return blocking ? { code: blocking[0], text: blocking[2](model) } : null;
}
