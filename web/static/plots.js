// Plots of force and pressure over a common time axis.

import { drawPeaks, drawStars } from "./contact-marks.js";
import { drawLimit } from "./limit-line.js";
import { createPlot, setData, showCursor, showSelection } from "./plot-canvas.js";
import { followKeys, followPointer } from "./plot-pointer.js";
import { forceRange, pressureRange } from "./plot-ranges.js";
import { clockLabels, clockTicks, liveLabels, liveTicks } from "./plot-ticks.js";
import { rangeText, sampleAt } from "./plot-values.js";
import { samplesAsCsv } from "./samples-csv.js";
import { Series } from "./series.js";
import { TimeWindow, pinchedRange } from "./time-window.js";
import { splitForces, touchNote } from "./touch.js";

const PLOT_PIXELS = 600; // typical width; no redraw while the curves move by less than one pixel
const MIN_PERIOD_MS = 50;
const IDLE_PERIOD_MS = 250; // redraw without samples, so that the time axis moves on
const NAMES = [
  ...["low_n", "high_n", "force_n", "std_n", "lower_limit_n", "pressure_kpa", "baseline_kpa"],
  ...["in_contact", "board_state"],
];

/**
 * Both plots. They are redrawn at most once per animation frame, and only if a change is visible.
 *
 * `onSample(sample)` is called with the sample at the pointer, null if there is none. `onWindow(timeWindow)` is
 * called after a pause, a zoom and a return to live plots.
 */
export class Plots {
  #series = new Series(NAMES);
  #window = new TimeWindow();
  #paused = null; // columns of the paused plots; the series goes on
  #contacts = [];
  #limit_n = NaN;
  #force;
  #pressure;
  #colours = {};
  #time = { t_s: -Infinity, at_ms: 0 }; // time of the host process, and when it was received
  #offset_s = null; // UTC minus the time of the host process
  #position = null; // of the pointer, from 0 to 1
  #pinched = null; // time axis at the start of a pinch
  #drawn_ms = 0;
  #isScheduled = false;
  #onSample;
  #onWindow;

  constructor(forceBox, pressureBox, { onSample = () => {}, onWindow = () => {} } = {}) {
    this.#onSample = onSample;
    this.#onWindow = onWindow;
    this.#readColours();
    const colour = (name) => () => this.#colours[name];
    const edge = { stroke: null, width: 0, points: { show: false }, auto: false };
    const line = (name, options) => ({
      stroke: colour(name),
      width: 2,
      points: { show: false },
      ...options,
    });
    this.#force = this.#createPlot(forceBox, {
      curves: [edge, edge, line("touch"), line("force")],
      bands: [{ series: [2, 1], fill: colour("band") }],
      range: (low, high) => forceRange(low, high, this.#limit_n),
      draw: (plot) => {
        drawLimit(plot, this.#limit_n, this.#colours.limit);
        drawPeaks(plot, this.#contacts, this.#colours);
      },
    });
    this.#pressure = this.#createPlot(pressureBox, {
      curves: [line("pressure"), line("baseline", { width: 1.5, dash: [6, 5] })],
      range: pressureRange,
      draw: (plot) => drawStars(plot, this.#contacts, this.#colours),
    });
    document.addEventListener("theme", () => this.#updateColours());
    setInterval(() => this.#window.isLive && this.#scheduleDraw(), IDLE_PERIOD_MS);
  }

  #createPlot(box, options) {
    const plot = createPlot(box, {
      ...options,
      colours: () => this.#colours,
      ticks: (of) =>
        this.#window.isLive ? liveTicks(of, this.#window.span_s) : clockTicks(of, this.#offset_s ?? 0),
      labels: (of, ticks) =>
        this.#window.isLive ? liveLabels(of, ticks) : clockLabels(ticks, this.#offset_s ?? 0),
    });
    followPointer(plot.over, {
      onPoint: (position) => this.#point(position),
      onSelect: (part) => this.#both((each) => showSelection(each, part)),
      onZoom: ([from, to]) => this.#zoom({ min: this.#timeAt(from), max: this.#timeAt(to) }),
      onPinchStart: () => (this.#pinched = this.#range()),
      onPinch: (before, now) => this.#zoom(pinchedRange(this.#pinched, before, now)),
      onReset: () => this.unzoom(),
    });
    followKeys(box, {
      onStep: (step) => {
        this.pause();
        this.#point(Math.min(1, Math.max(0, (this.#position ?? 1) + step)));
      },
      onScale: (factor) => this.#scale(factor),
      onReset: () => this.unzoom(),
    });
    showSelection(plot, null);
    showCursor(plot, null);
    return plot;
  }

  #both(act) {
    act(this.#force);
    act(this.#pressure);
  }

  /** Append new samples. */
  addSamples(batch) {
    this.#series.push(withBand(batch));
    this.#drawIfLive();
  }

  /** Insert older samples. */
  addHistory(batch) {
    this.#series.insert(withBand(batch));
    this.#drawIfLive();
  }

  /** Set the current time of the host process. The time axis moves on from there even without samples. */
  setTime(t_s) {
    this.#time = { t_s, at_ms: performance.now() };
    this.#offset_s ??= Date.now() / 1e3 - t_s; // until the web server has sent the time of the host
  }

  /** Set the time of day of the host: UTC minus the time of the samples [s]. */
  setClock(offset_s) {
    if (Number.isFinite(offset_s)) this.#offset_s = offset_s;
  }

  /** Return the time of day of the host minus the time of the samples [s]. */
  get clock_s() {
    return this.#offset_s ?? 0;
  }

  /** Set the contacts whose marks are drawn. */
  setContacts(rows) {
    this.#contacts = rows;
    this.#scheduleDraw();
  }

  /** Set the alarm limit of the force [N]; NaN if the limit is unknown. */
  setLimit(limit_n) {
    if (Object.is(limit_n, this.#limit_n)) return;
    this.#limit_n = limit_n;
    this.#scheduleDraw();
  }

  /** Set the duration [s] that the plots show. */
  setSpan(span_s) {
    this.#window.setSpan(span_s);
    this.#changeWindow();
  }

  /** Stop the plots. New samples are still collected. */
  pause() {
    if (!this.#window.isLive) return;
    this.#window.pause(this.#now_s());
    this.#changeWindow();
  }

  /** Show the current values again. */
  resume() {
    this.#window.resume();
    this.#changeWindow();
  }

  /** Undo the zoom. */
  unzoom() {
    this.#window.unzoom();
    this.#changeWindow();
  }

  #zoom(range) {
    this.#window.zoom(range, this.#now_s());
    this.#changeWindow();
  }

  #scale(factor) {
    const { min, max } = this.#range();
    const position = this.#position ?? 1;
    const centre = min + position * (max - min);
    this.#zoom({ min: centre - (centre - min) * factor, max: centre + (max - centre) * factor });
  }

  #changeWindow() {
    if (this.#window.isLive) this.#paused = null;
    else this.#paused ??= this.#series.latest(Infinity);
    this.#drawn_ms = 0;
    this.#scheduleDraw();
    this.#onWindow(this.#window);
  }

  /** Return the samples that are shown as CSV, and the time of the first sample since 1970 [s]. */
  csv() {
    return samplesAsCsv(this.#columns(), NAMES, this.#range(), this.clock_s);
  }

  #point(position) {
    this.#position = position;
    this.#both((each) => showCursor(each, position));
    this.#showSample();
  }

  #showSample() {
    const t_s = this.#position === null ? null : this.#timeAt(this.#position);
    this.#onSample(t_s === null ? null : sampleAt(this.#columns(), NAMES, t_s));
  }

  #timeAt(position) {
    const { min, max } = this.#range();
    return min + position * (max - min);
  }

  #now_s() {
    const host_s = this.#time.t_s + (performance.now() - this.#time.at_ms) / 1e3;
    return Math.max(host_s, this.#series.last_s ?? this.#window.span_s);
  }

  #range() {
    return this.#window.range(this.#now_s());
  }

  #columns() {
    return this.#paused ?? this.#series.latest(this.#window.span_s);
  }

  #drawIfLive() {
    if (this.#window.isLive) this.#scheduleDraw();
  }

  #scheduleDraw() {
    if (this.#isScheduled) return;
    this.#isScheduled = true;
    const period_ms = Math.max(MIN_PERIOD_MS, (this.#window.span_s * 1e3) / PLOT_PIXELS);
    const wait_ms = Math.max(0, this.#drawn_ms + period_ms - performance.now());
    setTimeout(() => requestAnimationFrame(() => this.#draw()), wait_ms);
  }

  #draw() {
    this.#isScheduled = false;
    this.#drawn_ms = performance.now();
    const [times, low, high, force, , limit, pressure, baseline, inContact] = this.#columns();
    const range = this.#range();
    const [measured, touch] = splitForces(force, limit, inContact);
    setData(this.#force, [times, low, high, touch, measured], range);
    setData(this.#pressure, [times, pressure, baseline], range);
    if (this.#position !== null) this.#showSample();
  }

  /** Update the labels for screen readers with the range of the values. */
  updateLabels() {
    const [, , , force, , limit, pressure, , inContact] = this.#columns();
    const span = this.#window.isLive ? `over the last ${this.#window.span_s} s` : "paused";
    const setLabel = ({ root }, text) => root.parentElement.setAttribute("aria-label", text);
    const forces = rangeText(force, 2, "newtons") + touchNote(force, limit, inContact);
    setLabel(this.#force, `Plot of the force ${span}: ${forces}`);
    setLabel(this.#pressure, `Plot of the pressure ${span}: ${rangeText(pressure, 2, "kilopascals")}`);
  }

  #readColours() {
    const colour = (name) => getComputedStyle(document.querySelector(`.${name}`)).color;
    const keys = {
      force: "force-key",
      touch: "touch-key",
      band: "force-band",
      peak: "peak-key",
      limit: "limit-key",
      pressure: "pressure-key",
      baseline: "baseline-key",
      initial: "initial-star",
      final: "final-star",
    };
    const plot = getComputedStyle(document.querySelector(".plot"));
    this.#colours = {
      ...Object.fromEntries(Object.entries(keys).map(([name, key]) => [name, colour(key)])),
      ink: plot.color,
      grid: plot.borderTopColor,
      edge: plot.outlineColor,
    };
  }

  #updateColours() {
    this.#readColours();
    this.#drawn_ms = 0;
    this.#scheduleDraw();
  }
}

/** Return the batch with the limits of the uncertainty band: force ± 2 standard uncertainties. */
function withBand(batch) {
  const edge = (sign) => (n, index) =>
    n === null || batch.std_n[index] === null ? null : n + sign * 2 * batch.std_n[index];
  return { ...batch, low_n: batch.force_n.map(edge(-1)), high_n: batch.force_n.map(edge(1)) };
}
