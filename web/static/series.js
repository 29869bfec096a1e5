// Samples of the last minute.

export const KEEP_S = 62;
const GAP_S = 0.5;

/** Columns of samples in order of time: at least the last `KEEP_S` seconds, and at most twice that time. */
export class Series {
  #columns;
  #names;

  constructor(names) {
    this.#names = names;
    this.#clear();
  }

  #clear() {
    this.#columns = [[], ...this.#names.map(() => [])];
  }

  get #last_s() {
    return this.last_s ?? -Infinity;
  }

  /** Time of the last sample [s]; undefined if there is none. */
  get last_s() {
    return this.#columns[0].at(-1);
  }

  /**
   * Append a batch {t_s: [...], name: [...]}.
   *
   * A batch that ends before the last sample clears the series, because the clock was reset.
   */
  push(batch) {
    if (batch.t_s.length && batch.t_s.at(-1) < this.#last_s) this.#clear();
    batch.t_s.forEach((t_s, index) => {
      if (t_s <= this.#last_s) return;
      this.#columns[0].push(t_s);
      this.#names.forEach((name, column) => this.#columns[column + 1].push(batch[name][index]));
    });
    this.#trim();
  }

  /** Insert a batch of older samples. The batch replaces all samples in its time span. */
  insert(batch) {
    if (!batch.t_s.length) return;
    const first = this.#indexAt(batch.t_s[0]);
    const count = this.#indexAt(batch.t_s.at(-1) + 1e-4) - first;
    [batch.t_s, ...this.#names.map((name) => batch[name])].forEach((values, index) =>
      this.#columns[index].splice(first, count, ...values),
    );
  }

  #trim() {
    const times = this.#columns[0];
    if (times.length && times[0] < this.#last_s - 2 * KEEP_S)
      this.#removeFirst(this.#indexAt(this.#last_s - KEEP_S));
  }

  #removeFirst(count) {
    for (const column of this.#columns) column.splice(0, count);
  }

  /** Return the index of the first sample at or after a time (binary search). */
  #indexAt(t_s) {
    const times = this.#columns[0];
    let low = 0;
    let high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] < t_s) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** Return the columns [t_s, ...names] of the last `span_s`, and one earlier sample to fill the plot. */
  latest(span_s) {
    const first = Math.max(0, this.#indexAt(this.#last_s - span_s) - 1);
    return withGaps(this.#columns.map((column) => column.slice(first)));
  }
}

/** Return columns with an empty sample after each pause that is longer than `GAP_S`, which ends the curve. */
function withGaps([times, ...values]) {
  for (let index = times.length - 1; index > 0; index--) {
    if (times[index] - times[index - 1] <= GAP_S) continue;
    for (const column of values) column.splice(index, 0, null);
    times.splice(index, 0, times[index] - 1e-3);
  }
  return [times, ...values];
}
