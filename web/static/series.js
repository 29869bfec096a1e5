// The last minute of samples, and never more.

export const KEPT_S = 62;
const GAP_S = 0.5;

/** Columns of samples in the order of their time, of which the last KEPT_S are kept. */
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
    return this.#columns[0].at(-1) ?? -Infinity;
  }

  /** Append a batch {t_s: [...], name: [...]}; a clock that went back begins anew, and a pause stays a gap. */
  push(batch) {
    if (batch.t_s.length && batch.t_s.at(-1) < this.#last_s) this.#clear();
    batch.t_s.forEach((t_s, at) => {
      if (t_s <= this.#last_s) return;
      if (t_s - this.#last_s > GAP_S && this.#columns[0].length) this.#append(t_s - 1e-3, () => null);
      this.#append(t_s, (name) => batch[name][at]);
    });
    this.#forget();
  }

  /** Put a batch of the past in its place: it is whole there. */
  insert(batch) {
    if (!batch.t_s.length) return;
    const first = this.#from(batch.t_s[0]);
    const count = this.#from(batch.t_s.at(-1) + 1e-4) - first;
    [batch.t_s, ...this.#names.map((name) => batch[name])].forEach((values, at) =>
      this.#columns[at].splice(first, count, ...values),
    );
  }

  #append(t_s, value) {
    this.#columns[0].push(t_s);
    this.#names.forEach((name, at) => this.#columns[at + 1].push(value(name)));
  }

  #forget() {
    const times = this.#columns[0];
    if (times.length && times[0] < this.#last_s - 2 * KEPT_S) this.#cut(this.#from(this.#last_s - KEPT_S));
  }

  #cut(count) {
    for (const column of this.#columns) column.splice(0, count);
  }

  /** Index of the first sample at or after a time. */
  #from(t_s) {
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

  /** The columns [t_s, ...names] of the last seconds, with one sample before them so that the curve has no stump. */
  latest(span_s) {
    const first = Math.max(0, this.#from(this.#last_s - span_s) - 1);
    return this.#columns.map((column) => column.slice(first));
  }
}
