// The table of contacts.

import { byId, showRows } from "./elements.js";
import { NOT_AVAILABLE, shown } from "./numbers.js";

const KEPT = 50;

/** Rows with those that are new or have changed: these take the place of all from the first one's number on. */
export const updated = (rows, news) =>
  news.length ? [...rows.filter(({ number }) => number < news[0].number), ...news].slice(-KEPT) : [];

/** Rows of the contacts, the latest first; `now_s` is the host's time. */
export function showContacts(rows, now_s) {
  byId("no-contacts").hidden = rows.length > 0;
  showRows(
    byId("contacts"),
    [...rows].reverse().map((row) => cells(row, now_s)),
  );
}

const cells = (row, now_s) => [
  String(row.number),
  row.open && Number.isFinite(now_s) ? "now" : ago(now_s - row.begin_s),
  row.peak_n === null ? NOT_AVAILABLE : `${shown(row.peak_n, 2)} ± ${shown(row.peak_std_n, 2)}`,
  shown(row.initial_kpa, 2),
  shown(row.final_kpa, 2),
  shown(row.radius_mm, 2),
  row.open && Number.isFinite(now_s) ? "pressed" : shown(row.open ? NaN : row.duration_s, 1),
];

function ago(seconds) {
  if (!Number.isFinite(seconds)) return NOT_AVAILABLE;
  return seconds < 120 ? `${shown(seconds, 0)} s ago` : `${shown(seconds / 60, 0)} min ago`;
}
