// The event log's last records.

import { byId, make } from "./elements.js";
import { clock, spoken } from "./numbers.js";

const KEPT = 100;

export const clearEvents = () => byId("events").replaceChildren();

/** Put a record on top, and drop the oldest beyond KEPT. */
export function showEvent({ at, kind, text }) {
  const list = byId("events");
  const time = make("time", "", when(at));
  time.dateTime = at;
  list.prepend(make("li", "", time, make("span", "kind", spoken(kind)), make("span", "", text)));
  while (list.childElementCount > KEPT) list.lastElementChild.remove();
}

function when(at) {
  const date = new Date(at);
  const today = date.toDateString() === new Date().toDateString();
  return today ? clock(date) : `${date.toLocaleDateString("en-CA")} ${clock(date)}`;
}
