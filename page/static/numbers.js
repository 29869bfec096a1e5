// How numbers, times and names are shown.

export const NOT_AVAILABLE = "–";

/** A number with so many digits behind the point; "–" where it is not available. */
export function shown(value, digits) {
  if (!Number.isFinite(value)) return NOT_AVAILABLE;
  const text = value.toFixed(digits);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

/** A count or a rate with a thin space at each thousand. */
export function counted(value, digits = 0) {
  return shown(value, digits).replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f");
}

/** How long [s] in the unit that suits. */
export function lasting(seconds) {
  if (!Number.isFinite(seconds)) return NOT_AVAILABLE;
  if (seconds < 1) return `${shown(seconds * 1e3, 0)} ms`;
  if (seconds < 100) return `${shown(seconds, 1)} s`;
  if (seconds < 6000) return `${shown(seconds / 60, 0)} min`;
  return `${shown(seconds / 3600, 1)} h`;
}

/** Time of day of this machine's clock. */
export const clock = (date) => date.toLocaleTimeString("en-GB");

/** A code's name as words: "in_contact" is "in contact". */
export const spoken = (name) => String(name ?? "").replaceAll("_", " ");

/** A whole number in hex, with at least so many digits. */
export const hex = (number, digits) => number.toString(16).toUpperCase().padStart(digits, "0");

/** A number as it came, in the six digits that a float is good for; "–" where it is none. */
export const plain = (number) =>
  Number.isFinite(number) ? String(Number(number.toPrecision(6))).replace("-", "−") : NOT_AVAILABLE;
