// Texts of the force alarm, which name its cause: the force, or a balloon that may be pressed flat.

import { formatNumber } from "./format.js";
import { isTouchState } from "./touch.js";

const NAME = "force_high_alarm";

/**
 * Return {cause, isOver, limit_n} of the force alarm of a state; null without the alarm.
 *
 * The cause is "force", "flat" or "unknown". `isOver` is true if the cause has ended, but not yet the alarm.
 */
export function forceAlarm(state) {
  if (!state?.status.includes(NAME)) return null;
  if (state.ended_alarm) return state.ended_alarm;
  const { force_n, force_uncompensated_n, force_limit_n: limit_n, status } = state;
  const alarm = (cause, isOver = false) => ({ cause, isOver, limit_n });
  const isAbove = Number.isFinite(force_n) && force_n > limit_n;
  if (isAbove && !isTouchState(state)) return alarm("force");
  if (status.includes("out_of_range")) return alarm("flat");
  if (isAbove || !Number.isFinite(force_uncompensated_n)) return alarm("unknown");
  // The alarm uses the force without lag compensation, and the pressure without a filter.
  return force_uncompensated_n > limit_n ? alarm("force", true) : alarm("flat", true);
}

/** Return the texts of the alarm for the bar, the figure and the title of the tab; "" without the alarm. */
export function forceAlarmTexts(state) {
  const alarm = forceAlarm(state);
  if (!alarm) return { bar: "", figure: "", title: "" };
  const limit = `${formatNumber(alarm.limit_n, 2)} N`;
  if (alarm.cause === "unknown")
    return {
      bar: `Force alarm, limit ${limit}. Back off.`,
      figure: `Force alarm, limit ${limit}`,
      title: "force alarm",
    };
  if (alarm.isOver) {
    const was = alarm.cause === "force" ? `was above ${limit}` : "the balloon may have been pressed flat";
    return { bar: `Force alarm: ${was}.`, figure: `Force alarm: ${was}`, title: `force alarm: ${was}` };
  }
  if (alarm.cause === "force")
    return {
      bar: `Force above ${limit}. Back off.`,
      figure: `Above the limit of ${limit}`,
      title: `force above ${limit}`,
    };
  return {
    bar: "The balloon may be pressed flat: assume the highest force. Back off.",
    figure: "The balloon may be pressed flat: assume the highest force",
    title: "balloon may be pressed flat",
  };
}
