// How old what comes is, told by two clocks that nobody has set.

const DRIFT = 2e-4; // by which one of them may run faster than the other

/** The age of what an instrument says, beside the newest that was heard of it. */
export class Age {
  #begun_s = null;
  #least_s = Infinity;
  #heard_s = 0;

  /** A connection begins. It proves nothing of its speed: only another instrument has another clock. */
  begin(begun_s) {
    if (begun_s === this.#begun_s) return;
    this.#begun_s = begun_s;
    this.#least_s = Infinity;
  }

  /** Of what was said at `t_s` by the instrument's clock, and comes at `now_s` by ours [s]. */
  of(t_s, now_s) {
    const drift_s = DRIFT * (now_s - this.#heard_s);
    this.#heard_s = now_s;
    this.#least_s = Math.min(this.#least_s + drift_s, now_s - t_s);
    return now_s - t_s - this.#least_s;
  }
}
