// Download of the samples in the plots as CSV. The columns have the names of `pneuforce export`. Two columns
// are added: `utc` and `force_note`.

import { TOUCH_ONLY, belowText, isTouchSample } from "./touch.js";

const COLUMNS = ["pressure_kpa", "baseline_kpa", "force_n", "std_n", "in_contact", "board_state"];
const EXPORT_NAMES = { std_n: "force_std_n", board_state: "state" };

/**
 * Return the samples from `range.min` to `range.max` as CSV, and the time of the first sample since 1970 [s].
 *
 * `t_s` counts from the first sample. An empty cell means that a value is not available. `force_note` marks a
 * force below the lower limit of measurement, and a contact without a force. `offset_s` is UTC minus the time of the samples.
 */
export function samplesAsCsv([times, ...values], names, { min, max }, offset_s) {
  const columns = COLUMNS.map((name) => values[names.indexOf(name)]);
  const isSample = (index) => columns.some((column) => column[index] !== null);
  const indices = [...times.keys()].filter(
    (index) => times[index] >= min && times[index] <= max && isSample(index),
  );
  const sampleAt = (index) => Object.fromEntries(names.map((name, column) => [name, values[column][index]]));
  const forceNote = (index) => {
    const sample = sampleAt(index);
    if (sample.in_contact && sample.force_n === null) return "no force";
    return isTouchSample(sample) ? `${TOUCH_ONLY}: ${belowText(sample.lower_limit_n)} N` : "";
  };
  const first_s = times[indices[0]] ?? NaN;
  const row = (index) => [
    Number((times[index] - first_s).toFixed(4)),
    new Date((times[index] + offset_s) * 1e3).toISOString(),
    ...columns.map((column) => column[index] ?? ""),
    forceNote(index),
  ];
  const header = ["t_s", "utc", ...COLUMNS.map((name) => EXPORT_NAMES[name] ?? name), "force_note"];
  const text = [header, ...indices.map(row)].map((cells) => `${cells.join(",")}\n`).join("");
  return { text, first_utc_s: first_s + offset_s };
}

/** Let the browser save a text as a file. */
export function saveText(text, name, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1e4);
}
