// Age of received data, estimated with two clocks that are not synchronized.

const MAX_DRIFT = 2e-4; // relative rate difference of the two clocks

/** Estimator of the age of received data. The age is the present delay minus the smallest delay so far. */
export class AgeEstimator {
  #started_s = null;
  #minOffset_s = Infinity;
  #received_s = 0;

  /**
   * Start a connection to the instrument that was started at `started_s`.
   *
   * If the instrument is the same, keep the smallest delay, because the clocks are the same. A new connection
   * may be slow from the start.
   */
  start(started_s) {
    if (started_s === this.#started_s) return;
    this.#started_s = started_s;
    this.#minOffset_s = Infinity;
  }

  /** Return the age [s] of data from `t_s` (clock of the instrument) that arrives at `now_s` (own clock). */
  age(t_s, now_s) {
    const drift_s = MAX_DRIFT * (now_s - this.#received_s);
    this.#received_s = now_s;
    this.#minOffset_s = Math.min(this.#minOffset_s + drift_s, now_s - t_s);
    return now_s - t_s - this.#minOffset_s;
  }
}
