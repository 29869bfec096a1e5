// Forces below the lower limit of measurement. They show only that something touches the balloon.

import { formatNumber } from "./format.js";

/** Words beside a force below the lower limit. */
export const TOUCH_ONLY = "touch only";

/** Return the limit [N] as the number that replaces a force below the limit. */
export const belowText = (limit_n) => `< ${formatNumber(limit_n, 2)}`;

/** Return true if a sample has a force below the lower limit. Without a contact, a force of 0 is measured. */
export const isTouchSample = ({ in_contact, force_n, lower_limit_n }) =>
  Boolean(in_contact) && isBelow(force_n, lower_limit_n);

/** Return true if the peak force of a contact is below the lower limit. */
export const isTouchContact = ({ peak_n, force_lower_range_limit_n }) =>
  isBelow(peak_n, force_lower_range_limit_n);

/** Return true if a state has a force below the lower limit. */
export const isTouchState = ({ force_n, status }) =>
  Number.isFinite(force_n) && status.includes("interpolated");

/**
 * Return [measured, touch]: the forces at or above the lower limit, and the others. Missing values are null.
 *
 * The neighbours of a touch are in both, so that the two curves are connected.
 */
export function splitForces(forces, limits, contacts) {
  const isTouch = touches(forces, limits, contacts);
  const isNear = (index) => isTouch[index - 1] || isTouch[index] || isTouch[index + 1];
  return [
    forces.map((force_n, index) => (isTouch[index] ? null : force_n)),
    forces.map((force_n, index) => (isNear(index) ? force_n : null)),
  ];
}

/** Return a note about the forces below the lower limit as words for screen readers; "" if there are none. */
export const touchNote = (forces, limits, contacts) =>
  touches(forces, limits, contacts).includes(true) ? `; values below the lower limit are ${TOUCH_ONLY}` : "";

const touches = (forces, limits, contacts) =>
  forces.map((force_n, index) =>
    isTouchSample({ force_n, lower_limit_n: limits[index], in_contact: contacts[index] }),
  );

const isBelow = (force_n, limit_n) =>
  Number.isFinite(force_n) && Number.isFinite(limit_n) && force_n < limit_n;
