// Part of the time that the plots show: live, paused, or a part of the paused time (zoom).

const MIN_ZOOM_S = 0.05;

/** Time window of the plots. All times are times of the host process [s]. */
export class TimeWindow {
  span_s = 30; // duration that the live plots show
  #paused = null; // {min, max} of the paused plots
  #zoomed = null; // {min, max} within the paused time
  #isPausedByZoom = false;

  get isLive() {
    return this.#paused === null;
  }

  get isZoomed() {
    return this.#zoomed !== null;
  }

  /** Return {min, max} of the time axis. `now_s` is used only while the plots are live. */
  range(now_s) {
    return this.#zoomed ?? this.#paused ?? { min: now_s - this.span_s, max: now_s };
  }

  /** Stop the time axis. */
  pause(now_s) {
    this.#paused ??= this.range(now_s);
    this.#isPausedByZoom = false;
  }

  /** Show the current time again. */
  resume() {
    this.#paused = this.#zoomed = null;
  }

  /** Set the duration. Paused plots keep the end of their time axis. */
  setSpan(span_s) {
    this.span_s = span_s;
    this.#zoomed = null;
    if (this.#paused) this.#paused = { min: this.#paused.max - span_s, max: this.#paused.max };
  }

  /** Show a part of the time axis. Live plots are paused first. A part outside the paused time is moved. */
  zoom({ min, max }, now_s) {
    const isPausedByZoom = this.isLive || this.#isPausedByZoom;
    this.pause(now_s);
    this.#isPausedByZoom = isPausedByZoom;
    const full = this.#paused;
    const width = Math.max(max - min, MIN_ZOOM_S);
    if (width >= full.max - full.min) return void (this.#zoomed = null);
    const low = Math.min(Math.max(min, full.min), full.max - width);
    this.#zoomed = { min: low, max: low + width };
  }

  /** Undo the zoom. If the zoom had paused the plots, the plots are live again. */
  unzoom() {
    this.#zoomed = null;
    if (this.#isPausedByZoom) this.resume();
  }
}

/** Return the time axis after two fingers have moved. The times under the fingers stay under the fingers. */
export function pinchedRange({ min, max }, before, now) {
  const [first, last] = before.map((position) => min + position * (max - min));
  const width = (last - first) / Math.max(now[1] - now[0], 1e-3);
  return { min: first - now[0] * width, max: first + (1 - now[0]) * width };
}
