// Texts of the force alarm, which name its cause: the force, or a large pressure rise.

import { formatNumber } from "./format.js";
import { isTouchState } from "./touch.js";

/** Pressure rise above which the instrument sets the force alarm at each limit [kPa]. */
export const ALARM_RISE_KPA = 6;

const NAME = "force_high_alarm";

/**
 * Return {cause, isOver, limit_n} of the force alarm of a state; null without the alarm.
 *
 * The cause is "force", "rise" or "unknown". `isOver` is true if the cause has ended, but not yet the alarm.
 */
export function forceAlarm(state) {
  if (!state?.status.includes(NAME)) return null;
  if (state.ended_alarm) return state.ended_alarm;
  const { force_n, force_uncompensated_n, force_limit_n: limit_n, rise_kpa } = state;
  const alarm = (cause, isOver = false) => ({ cause, isOver, limit_n });
  const isAbove = Number.isFinite(force_n) && force_n > limit_n;
  if (isAbove && !isTouchState(state)) return alarm("force");
  if (rise_kpa > ALARM_RISE_KPA) return alarm("rise");
  if (isAbove || !Number.isFinite(force_uncompensated_n)) return alarm("unknown");
  // The alarm compares the force without lag compensation, and the rise without filter.
  return force_uncompensated_n > limit_n ? alarm("force", true) : alarm("rise");
}

/** Return the texts of the alarm for the bar, the figure and the title of the tab; "" without the alarm. */
export function forceAlarmTexts(state) {
  const alarm = forceAlarm(state);
  if (!alarm) return { bar: "", figure: "", title: "" };
  const limit = `${formatNumber(alarm.limit_n, 2)} N`;
  const rise = `${ALARM_RISE_KPA} kPa`;
  if (alarm.cause === "unknown")
    return {
      bar: `Force alarm, limit ${limit}. Back off.`,
      figure: `Force alarm, limit ${limit}`,
      title: "force alarm",
    };
  if (alarm.isOver) {
    const was = alarm.cause === "force" ? `was above ${limit}` : `pressure rise was above ${rise}`;
    return { bar: `Force alarm: ${was}.`, figure: `Force alarm: ${was}`, title: `force alarm: ${was}` };
  }
  if (alarm.cause === "force")
    return {
      bar: `Force above ${limit}. Back off.`,
      figure: `Above the limit of ${limit}`,
      title: `force above ${limit}`,
    };
  const advice = Number.isFinite(state.force_n)
    ? "the force may be higher than shown"
    : "assume the highest force";
  return {
    bar: `Pressure rise above ${rise}: ${advice}. Back off.`,
    figure: `Pressure rise above ${rise}: ${advice}`,
    title: `pressure rise above ${rise}`,
  };
}
