// Values of one sample: search in the columns of the plots, and text.

import { NOT_AVAILABLE, formatName, formatNumber } from "./format.js";
import { formatClock } from "./plot-ticks.js";
import { TOUCH_ONLY, belowText, isTouchSample } from "./touch.js";

const MAX_DISTANCE_S = 0.1; // a sample that is further away is not the value at the pointer

/**
 * Return the sample nearest to a time as {t_s, name: value}; null if no sample is near.
 *
 * `columns` is [times, ...values], and `names` are the names of the values.
 */
export function sampleAt([times, ...values], names, t_s) {
  const index = nearest(times, t_s);
  if (index === null || Math.abs(times[index] - t_s) > MAX_DISTANCE_S) return null;
  return { t_s: times[index], ...Object.fromEntries(names.map((name, at) => [name, values[at][index]])) };
}

function nearest(times, t_s) {
  if (!times.length) return null;
  let low = 0;
  let high = times.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t_s) low = middle;
    else high = middle;
  }
  return t_s - times[low] <= times[high] - t_s ? low : high;
}

/** Return the texts of a sample: time of day, force ± 2 u, pressure, and state. */
export function valueTexts(sample, offset_s, states) {
  const { t_s, pressure_kpa, board_state, in_contact } = sample;
  const name = states[board_state] ? formatName(states[board_state]) : NOT_AVAILABLE;
  return [
    formatClock(t_s + offset_s, 2),
    forceText(sample),
    `${formatNumber(pressure_kpa, 2)} kPa`,
    in_contact ? `${name}, in contact` : name,
  ];
}

function forceText(sample) {
  const { force_n, std_n, lower_limit_n } = sample;
  if (isTouchSample(sample)) return `${belowText(lower_limit_n)} N, ${TOUCH_ONLY}`;
  if (force_n === null || Number.isNaN(force_n)) return "no force";
  return `${formatNumber(force_n, 2)} ± ${formatNumber(std_n === null ? NaN : 2 * std_n, 2)} N (2 u)`;
}

/** Return the range of the values as words for screen readers. */
export function rangeText(values, decimals, unit) {
  const available = values.filter((value) => value !== null);
  if (!available.length) return "not available";
  const [low, high] = available.reduce(
    ([l, h], v) => [Math.min(l, v), Math.max(h, v)],
    [Infinity, -Infinity],
  );
  return `between ${formatNumber(low, decimals)} and ${formatNumber(high, decimals)} ${unit}`;
}
