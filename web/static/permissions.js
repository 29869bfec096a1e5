// Check whether an action is possible now. The instrument decides; this check avoids useless requests.

/** Return the name of a bus as words, for example "Modbus TCP" for the code modbus_tcp. */
const busName = (code) => ({ modbus_tcp: "Modbus TCP", modbus_rtu: "Modbus RTU", can: "CAN" })[code] ?? code;

const isUntripped = ({ state }) => !state.faults.length && state.state !== "tripped";

/** Conditions of all actions that need an operator. */
const LOGIN = [
  [
    "no_users",
    ({ session }) => session.user || session.hasUsers,
    () => "No user exists: this page can only vent. Create a user with pneuforce users add.",
  ],
  [
    "login_ended",
    ({ session }) => session.user || !session.isEnded,
    () => "Your login has ended. Log in again.",
  ],
  ["logged_out", ({ session }) => session.user, () => "Log in to use the controls."],
  [
    "no_right",
    ({ session }) => session.user.may_write,
    ({ session }) => `${session.user.name} is a ${session.user.role}: this page can only vent.`,
  ],
];

/** Conditions of all actions: code, predicate, and the text if the predicate is false. */
const COMMON = [
  ["disconnected", ({ link, state }) => link.up && state, () => "Not connected."],
  [
    "loading",
    ({ info }) => info.map_version !== undefined,
    () => "Loading the data of the instrument.",
  ],
  ...LOGIN,
  [
    "lease",
    ({ state }) => ["none", "web"].includes(state.lease_holder),
    ({ state }) => `A client on ${busName(state.lease_holder)} has the lease: this page can only vent.`,
  ],
  [
    "write_protect",
    ({ state }) => !state.status.includes("write_protect"),
    () => "The configuration disables writing. VENT works.",
  ],
];

const VENTED = [
  "not_vented",
  ({ state }) => state.state === "vented",
  ({ state }) =>
    state.state === "venting" ? "Venting: wait until the balloon is empty." : "Only while vented.",
];

/** Action → further conditions. */
const CONDITIONS = {
  setpoint: [],
  limit: [],
  hold: [
    ["tripped", isUntripped, () => "Tripped. Clear the faults, then press VENT once."],
    [
      "holding",
      ({ state }) => state.mode !== "hold",
      ({ state }) => `Already ${state.state === "holding" ? "holding" : "inflating"}. Vent to start over.`,
    ],
    [
      "vent_due",
      ({ arming }) => !arming.isVentDue,
      () => "Press VENT once to enable Inflate.",
    ],
    [
      "no_setpoint",
      ({ state }) => Number.isFinite(state.setpoint_requested_kpa),
      () => "Set a setpoint to enable Inflate.",
    ],
    VENTED,
    [
      "not_zeroed",
      ({ state }) => !state.status.includes("not_zeroed"),
      () => "No zero yet: wait until the pressure is steady.",
    ],
  ],
  clear: [["no_fault", (model) => !isUntripped(model), () => "No faults."]],
  balloon: [
    [
      "not_vented",
      ({ state }) => state.status.includes("vented"),
      () => "Only while vented.",
    ],
  ],
  zero: [["tripped", isUntripped, () => "Tripped. Clear the faults."], VENTED],
};

/**
 * Return {code, text} of the first condition that blocks an action; null if the action is possible.
 *
 * `model` has link, info, session, arming and state.
 */
export function blockedBy(action, model) {
  return firstFalse([...COMMON, ...CONDITIONS[action]], model);
}

/** Return {code, text} of the reason why the login does not permit a recording; null if it does. */
export const recordingBlockedBy = (model) => firstFalse(LOGIN, model);

function firstFalse(conditions, model) {
  const blocking = conditions.find(([, holds]) => !holds(model));
  return blocking ? { code: blocking[0], text: blocking[2](model) } : null;
}
