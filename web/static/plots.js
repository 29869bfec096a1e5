// Plots of force and pressure over a common time axis.

import uPlot from "./vendor/uPlot.esm.js";
import { drawPeaks, drawStars } from "./contact-marks.js";
import { formatNumber } from "./format.js";
import { Series } from "./series.js";

const AXIS_WIDTH_EM = 3.4;
const PLOT_PIXELS = 600; // typical width; no redraw while the curves move by less than one pixel
const MIN_PERIOD_MS = 50;
const IDLE_PERIOD_MS = 250; // redraw without samples, so that the time axis moves on
const NARROW_PX = 480;
const TICK_STEPS_S = { 10: 2, 30: 5, 60: 10 }; // by the span of the plot

/** Return the range of the force axis: at least −0.5 to 2 N, extended to whole newtons. */
const forceRange = (_, low, high) => [low < -0.5 ? Math.floor(low) : -0.5, Math.max(2, Math.ceil(high ?? 0))];

/** Return the range of the pressure axis: at least 4 kPa, with space for a star and its number. */
const pressureRange = (_, low, high) => {
  const floor = Math.floor((low ?? 0) - 0.4);
  return [floor, Math.max(floor + 4, high + 0.5 + 0.2 * (high - floor))];
};

/** Both plots. They are redrawn at most once per animation frame, and only if a change is visible. */
export class Plots {
  #series = new Series(["low_n", "high_n", "force_n", "pressure_kpa", "baseline_kpa"]);
  #contacts = [];
  #span_s = 30;
  #force;
  #pressure;
  #colours = {};
  #time = { t_s: -Infinity, at_ms: 0 }; // time of the host process, and when it was received
  #drawn_ms = 0;
  #isScheduled = false;

  constructor(forceBox, pressureBox) {
    this.#readColours();
    const colour = (name) => () => this.#colours[name];
    const edge = { stroke: null, width: 0, points: { show: false } };
    const line = (name, options) => ({
      stroke: colour(name),
      width: 2,
      points: { show: false },
      ...options,
    });
    const forceCurves = [edge, edge, line("force")];
    const bands = [{ series: [2, 1], fill: colour("band") }];
    this.#force = this.#createPlot(forceBox, forceCurves, forceRange, { bands }, (plot) =>
      drawPeaks(plot, this.#contacts, this.#colours.peak),
    );
    const pressureCurves = [line("pressure"), line("baseline", { width: 1.5, dash: [6, 5] })];
    this.#pressure = this.#createPlot(pressureBox, pressureCurves, pressureRange, {}, (plot) =>
      drawStars(plot, this.#contacts, this.#colours),
    );
    document.addEventListener("theme", () => this.#updateColours());
    setInterval(() => this.#scheduleDraw(), IDLE_PERIOD_MS);
  }

  #createPlot(box, curves, range, extraOptions, draw) {
    const em = () => parseFloat(getComputedStyle(box).fontSize);
    const axis = (side) => ({
      side,
      stroke: () => this.#colours.ink,
      grid: { stroke: () => this.#colours.grid, width: 1 },
      ticks: { show: false },
      font: `${Math.round(em() * 0.85)}px system-ui, sans-serif`,
    });
    const times = {
      ...axis(2),
      splits: (plot) => this.#ticks(plot),
      values: (plot, ticks) => timeLabels(plot, ticks),
      gap: em() * 0.5,
      size: em() * 2.2,
    };
    const options = {
      width: box.clientWidth,
      height: box.clientHeight,
      scales: { x: { time: false, auto: false, range: (plot, low, high) => [low, high] }, y: { range } },
      series: [{}, ...curves],
      axes: [times, { ...axis(3), size: em() * AXIS_WIDTH_EM, space: em() * 2.2, values: numberLabels }],
      legend: { show: false },
      cursor: { show: false },
      padding: [em() * 0.5, em() * 0.9, 0, 0],
      hooks: { draw: [draw] },
      ...extraOptions,
    };
    const plot = new uPlot(options, [[], ...curves.map(() => [])], box);
    new ResizeObserver(() => plot.setSize({ width: box.clientWidth, height: box.clientHeight })).observe(box);
    return plot;
  }

  /** Return the ticks of the time axis, counted back from now; half as many if the plot is narrow. */
  #ticks({ width, scales: { x } }) {
    const step_s = TICK_STEPS_S[this.#span_s] * (width < NARROW_PX ? 2 : 1);
    const count = Math.floor(this.#span_s / step_s) + 1;
    return Array.from({ length: count }, (_, index) => x.max - index * step_s).reverse();
  }

  /** Append new samples. */
  addSamples(batch) {
    this.#series.push(withBand(batch));
    this.#scheduleDraw();
  }

  /** Insert older samples. */
  addHistory(batch) {
    this.#series.insert(withBand(batch));
    this.#scheduleDraw();
  }

  /** Set the current time of the host process. The time axis moves on from there even without samples. */
  setTime(t_s) {
    this.#time = { t_s, at_ms: performance.now() };
  }

  /** Set the contacts whose marks are drawn. */
  setContacts(rows) {
    this.#contacts = rows;
    this.#scheduleDraw();
  }

  /** Set the duration [s] that the plots show. */
  setSpan(span_s) {
    this.#span_s = span_s;
    this.#drawn_ms = 0;
    this.#scheduleDraw();
  }

  #scheduleDraw() {
    if (this.#isScheduled) return;
    this.#isScheduled = true;
    const period_ms = Math.max(MIN_PERIOD_MS, (this.#span_s * 1e3) / PLOT_PIXELS);
    const wait_ms = Math.max(0, this.#drawn_ms + period_ms - performance.now());
    setTimeout(() => requestAnimationFrame(() => this.#draw()), wait_ms);
  }

  #draw() {
    this.#isScheduled = false;
    this.#drawn_ms = performance.now();
    const [times, low, high, force, pressure, baseline] = this.#series.latest(this.#span_s);
    const host_s = this.#time.t_s + (this.#drawn_ms - this.#time.at_ms) / 1e3;
    const now_s = Math.max(host_s, times.at(-1) ?? this.#span_s);
    const x = { min: now_s - this.#span_s, max: now_s };
    setData(this.#force, [times, low, high, force], x);
    setData(this.#pressure, [times, pressure, baseline], x);
  }

  /** Update the labels for screen readers with the range of the values. */
  updateLabels() {
    const [, , , force, pressure] = this.#series.latest(this.#span_s);
    const span = `over the last ${this.#span_s} s`;
    const setLabel = ({ root }, text) => root.parentElement.setAttribute("aria-label", text);
    setLabel(this.#force, `Plot of the force ${span}: ${rangeText(force, 2, "newtons")}`);
    setLabel(this.#pressure, `Plot of the pressure ${span}: ${rangeText(pressure, 2, "kilopascals")}`);
  }

  #readColours() {
    const colour = (name) => getComputedStyle(document.querySelector(`.${name}`)).color;
    const keys = [
      "force-key",
      "force-band",
      "peak-key",
      "pressure-key",
      "baseline-key",
      "initial-star",
      "final-star",
    ];
    const [force, band, peak, pressure, baseline, initial, final] = keys.map(colour);
    const {
      color: ink,
      borderTopColor: grid,
      outlineColor: edge,
    } = getComputedStyle(document.querySelector(".plot"));
    this.#colours = { force, band, peak, pressure, baseline, initial, final, ink, grid, edge };
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

function setData(plot, columns, x) {
  plot.batch(() => {
    plot.setData(columns, false);
    plot.setScale("x", x);
  });
}

const numberLabels = (_, ticks) =>
  ticks.map((value) => formatNumber(value, ticks.some((other) => other % 1) ? 1 : 0));

const timeLabels = ({ scales: { x } }, ticks) =>
  ticks.map((t_s) => (t_s === x.max ? "now" : `${formatNumber(t_s - x.max, 0)} s`));

function rangeText(values, decimals, unit) {
  const available = values.filter((value) => value !== null);
  if (!available.length) return "not available";
  const [low, high] = available.reduce(
    ([l, h], v) => [Math.min(l, v), Math.max(h, v)],
    [Infinity, -Infinity],
  );
  return `between ${formatNumber(low, decimals)} and ${formatNumber(high, decimals)} ${unit}`;
}
