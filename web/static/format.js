// Formatting of numbers, times and names.

export const NOT_AVAILABLE = "–";

/** Format a number with a fixed number of decimals; "–" if the number is not available. */
export function formatNumber(value, decimals) {
  if (!Number.isFinite(value)) return NOT_AVAILABLE;
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

/** Format a count or a rate with a thin space between thousands. */
export function formatCount(value, decimals = 0) {
  return formatNumber(value, decimals).replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f");
}

/** Format a duration [s] in ms, s, min or h. */
export function formatDuration(seconds) {
  if (!Number.isFinite(seconds)) return NOT_AVAILABLE;
  if (seconds < 1) return `${formatNumber(seconds * 1e3, 0)} ms`;
  if (seconds < 100) return `${formatNumber(seconds, 1)} s`;
  if (seconds < 6000) return `${formatNumber(seconds / 60, 0)} min`;
  return `${formatNumber(seconds / 3600, 1)} h`;
}

/** Format an elapsed time [s] as h:mm:ss; a time below one minute in s with one decimal. */
export function formatElapsed(seconds) {
  if (Math.round(seconds * 10) < 600) return `${formatNumber(seconds, 1)} s`;
  const [minutes, s] = [Math.floor((seconds + 0.05) / 60), Math.floor((seconds + 0.05) % 60)];
  const twoDigits = (number) => String(number).padStart(2, "0");
  return `${Math.floor(minutes / 60)}:${twoDigits(minutes % 60)}:${twoDigits(s)}`;
}

/** Format a size in kB, MB or GB (powers of 1000) with three significant digits or more. */
export function formatBytes(bytes) {
  const [divisor, unit] = bytes < 1e6 ? [1e3, "kB"] : bytes < 1e9 ? [1e6, "MB"] : [1e9, "GB"];
  const size = bytes / divisor;
  return `${formatNumber(size, size < 10 ? 2 : size < 100 ? 1 : 0)} ${unit}`;
}

/** Format the local time of day of a Date as hh:mm:ss. */
export const formatTime = (date) => date.toLocaleTimeString("en-GB");

/** Format the name of a code as words: "in_contact" becomes "in contact". */
export const formatName = (name) => String(name ?? "").replaceAll("_", " ");

/** Format an integer in hexadecimal with at least this number of digits. */
export const formatHex = (number, digits) => number.toString(16).toUpperCase().padStart(digits, "0");

/** Format a number with six significant digits, the precision of a 32-bit float; "–" if not available. */
export const formatFloat = (number) =>
  Number.isFinite(number) ? String(Number(number.toPrecision(6))).replace("-", "−") : NOT_AVAILABLE;
