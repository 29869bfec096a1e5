// Questions of the confirmation dialog: their texts, and when a question is outdated.

import { formatNumber } from "./format.js";
import { blockedBy } from "./permissions.js";

/** Return true if the action of a question is blocked, if its values have changed, or if a vent contradicts it. */
export const isOutdated = (question, model) =>
  blockedBy(question.action, model) !== null ||
  Object.entries(question.values).some(([name, value]) => model.state[name] !== value) ||
  isVentedSince(question, model);

/** Return true if a client has requested a vent since the question about an inflation was opened. */
export const isVentedSince = ({ action, vent_s }, { state }) => action === "hold" && state?.vent_requested_s > vent_s;

export const moveQuestion = (to_kpa, warning) => ({
  title: `Move to ${formatNumber(to_kpa, 2)} kPa?`,
  text:
    `The pressure will move to ${formatNumber(to_kpa, 2)} kPa ` +
    `as soon as nothing touches the balloon. ${warning}`,
  confirmLabel: "Move",
});

export const inflateQuestion = (balloon_id, from_kpa, to_kpa, warning) => ({
  title: `Inflate to ${formatNumber(to_kpa, 2)} kPa?`,
  text:
    `Balloon ${balloon_id}, from ${formatNumber(from_kpa, 2)} kPa to ${formatNumber(to_kpa, 2)} kPa. ` +
    `Nothing may touch the balloon until the state is holding. ${warning}`,
  confirmLabel: `Inflate to ${formatNumber(to_kpa, 2)} kPa`,
});

export const balloonQuestion = (number) => ({
  title: `New balloon ${number}?`,
  text:
    "The inflations are counted from 0. If the configuration names another balloon, its calibration is not " +
    "used until the instrument is restarted.",
  confirmLabel: "New balloon",
});
