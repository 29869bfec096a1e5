// List of the latest records of the event log.

import { byId, create } from "./elements.js";
import { formatName, formatTime } from "./format.js";

const MAX_EVENTS = 100; // the server sends the last 50 first

/** Replace the list by these records, of which the last is the latest. */
export function showEvents({ rows }) {
  byId("events").replaceChildren();
  rows.forEach(showEvent);
}

/** Add a record at the top of the list and remove the oldest record beyond `MAX_EVENTS`. */
export function showEvent({ at, kind, text }) {
  const list = byId("events");
  const time = create("time", "", formatDate(at));
  time.dateTime = at;
  list.prepend(create("li", "", time, create("span", "kind", formatName(kind)), create("span", "", text)));
  while (list.childElementCount > MAX_EVENTS) list.lastElementChild.remove();
}

function formatDate(at) {
  const date = new Date(at);
  const isToday = date.toDateString() === new Date().toDateString();
  return isToday ? formatTime(date) : `${date.toLocaleDateString("en-CA")} ${formatTime(date)}`;
}
