// Ranges of the force axis and of the pressure axis.

const MIN_TOP_N = 2;
const MIN_BOTTOM_N = -0.5;
const MARGIN = 1.15; // space above the highest force, for the mark of a peak and a part of the band
const NEAR_LIMIT = 0.6; // the axis contains the alarm limit if a force above this part of the limit is shown

/**
 * Return [low, high] of the force axis [N] for the lowest and the highest force that are shown.
 *
 * The uncertainty band has no influence. A burst balloon has a band of many newtons for a moment, and the curve
 * would become a flat line. `limit_n` is the alarm limit, NaN if it is unknown.
 */
export function forceRange(low_n, high_n, limit_n) {
  const step_n = high_n > 4 ? 1 : 0.5;
  const top = Math.max(MIN_TOP_N, Math.ceil(((high_n ?? 0) * MARGIN) / step_n) * step_n);
  const bottom = low_n < MIN_BOTTOM_N ? Math.floor(low_n) : MIN_BOTTOM_N;
  const isLimitNear = high_n >= NEAR_LIMIT * limit_n;
  return [bottom, isLimitNear ? Math.max(top, limit_n * 1.1) : top];
}

/** Return [low, high] of the pressure axis [kPa]: at least 4 kPa, with space for a star and its number. */
export function pressureRange(low_kpa, high_kpa) {
  const floor = Math.floor((low_kpa ?? 0) - 0.4);
  return [floor, Math.max(floor + 4, (high_kpa ?? 0) + 0.5 + 0.2 * ((high_kpa ?? 0) - floor))];
}
