// Table of contacts.

import { byId, showRows } from "./elements.js";
import { NOT_AVAILABLE, formatNumber } from "./format.js";
import { TOUCH_ONLY, belowText, isTouchContact } from "./touch.js";

const MAX_ROWS = 50;

/** Return the rows after an update. It replaces the rows from its first number on. An empty update clears all. */
export const mergeContacts = (rows, update) =>
  update.length
    ? [...rows.filter(({ number }) => number < update[0].number), ...update].slice(-MAX_ROWS)
    : [];

/** Show the contacts, the latest first. `state` is the state of the instrument, null if it is not known. */
export function showContacts(rows, state) {
  const now_s = state?.t_s ?? NaN;
  const isCurrent = Boolean(state) && !state.status.includes("stale");
  byId("no-contacts").hidden = rows.length > 0;
  showRows(
    byId("contacts"),
    [...rows].reverse().map((row) => cells(row, now_s, isCurrent)),
  );
}

const cells = (row, now_s, isCurrent) => [
  String(row.number),
  row.open && isCurrent ? "now" : formatTimeAgo(now_s - row.begin_s),
  peakText(row),
  String(row.peaks),
  formatNumber(row.baseline_kpa, 2),
  formatNumber(row.final_kpa, 2),
  formatNumber(row.radius_mm, 2),
  durationText(row, isCurrent),
];

/** Return the duration [s]. If the beginning or the end is missing, the contact is longer than the shown part. */
export function durationText(row, isCurrent) {
  if (row.open) return isCurrent ? "in contact" : NOT_AVAILABLE;
  return `${row.cut || row.interrupted ? "> " : ""}${formatNumber(row.duration_s, 1)}`;
}

/** Return the peak force [N] with its uncertainty. A touch has no number that could be read as a measurement. */
export function peakText(row) {
  if (row.peak_n === null) return "no force";
  if (isTouchContact(row)) return `${belowText(row.force_lower_range_limit_n)}, ${TOUCH_ONLY}`;
  return `${formatNumber(row.peak_n, 2)} ± ${formatNumber(2 * row.peak_std_n, 2)}`;
}

function formatTimeAgo(seconds) {
  if (!Number.isFinite(seconds)) return NOT_AVAILABLE;
  return seconds < 120 ? `${formatNumber(seconds, 0)} s ago` : `${formatNumber(seconds / 60, 0)} min ago`;
}
