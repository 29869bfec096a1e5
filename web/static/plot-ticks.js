// Ticks of the time axis: seconds before now in live plots, the time of day in paused plots.

import { formatNumber } from "./format.js";

const NARROW_PX = 480;
const LIVE_STEPS_S = { 10: 2, 30: 5, 60: 10 }; // by the span of the plot
const STEPS_S = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20];
const MAX_TICKS = 7;
const MAX_TICKS_NARROW = 3;

/** Return the ticks, counted back from now; half as many if the plot is narrow. */
export function liveTicks({ width, scales: { x } }, span_s) {
  const step_s = LIVE_STEPS_S[span_s] * (width < NARROW_PX ? 2 : 1);
  const count = Math.floor(span_s / step_s) + 1;
  return Array.from({ length: count }, (_, index) => x.max - index * step_s).reverse();
}

/** Return ticks at round times of the day. `offset_s` is the time of day minus the time of the plot. */
export function clockTicks({ width, scales: { x } }, offset_s) {
  const max_ticks = width < NARROW_PX ? MAX_TICKS_NARROW : MAX_TICKS;
  const step_s = STEPS_S.find((step) => (x.max - x.min) / step <= max_ticks) ?? STEPS_S.at(-1);
  const first = Math.ceil((x.min + offset_s) / step_s);
  const last = Math.floor((x.max + offset_s) / step_s);
  return Array.from({ length: last - first + 1 }, (_, index) => (first + index) * step_s - offset_s);
}

/** Return the labels of ticks in a live plot. */
export const liveLabels = ({ scales: { x } }, ticks) =>
  ticks.map((t_s) => (t_s === x.max ? "now" : `${formatNumber(t_s - x.max, 0)} s`));

/** Return the labels of ticks in a paused plot: the time of day, with the decimals that the step needs. */
export function clockLabels(ticks, offset_s) {
  const step_s = ticks.length > 1 ? ticks[1] - ticks[0] : 1;
  const decimals = Math.max(0, Math.ceil(-Math.log10(step_s) - 1e-6));
  return ticks.map((t_s) => formatClock(t_s + offset_s, decimals));
}

/** Format a time since 1970 [s] as the local time of day with decimals of the second. */
export function formatClock(utc_s, decimals) {
  const unit = 10 ** decimals;
  const rounded_s = Math.round(utc_s * unit) / unit;
  const time = new Date(Math.floor(rounded_s) * 1e3).toLocaleTimeString("en-GB");
  const fraction = Math.round((rounded_s - Math.floor(rounded_s)) * unit);
  return decimals ? `${time}.${String(fraction).padStart(decimals, "0")}` : time;
}
