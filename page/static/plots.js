// The curves of force and pressure over one axis of time.

import uPlot from "./vendor/uPlot.esm.js";
import { shown } from "./numbers.js";
import { Series } from "./series.js";
import { drawPeaks, drawStars } from "./stars.js";

const AXIS_WIDTH = 3.4; // of the letters' height
const PIXEL_OF_S = 1 / 600; // a span's part that one pixel shows: to draw more often moves nothing
const LEAST_PERIOD_MS = 50;
const SILENT_PERIOD_MS = 250; // of the axis alone, which runs on
const NARROW = 480; // [px]
const TICKS_S = { 10: 2, 30: 5, 60: 10 };

/** At least from −0.5 to 2 N, else by whole newtons. */
const forceRange = (_, low, high) => [low < -0.5 ? Math.floor(low) : -0.5, Math.max(2, Math.ceil(high ?? 0))];

/** At least 4 kPa, with room for a star and its number above. */
const pressureRange = (_, low, high) => {
  const floor = Math.floor((low ?? 0) - 0.4);
  return [floor, Math.max(floor + 4, high + 0.5 + 0.2 * (high - floor))];
};

/** Both plots: fed samples and contacts, drawn at most once a frame and never more often than it shows. */
export class Plots {
  #series = new Series(["low_n", "high_n", "force_n", "pressure_kpa", "initial_kpa"]);
  #contacts = [];
  #span_s = 30;
  #force;
  #pressure;
  #colours = {};
  #clock = { t_s: -Infinity, at_ms: 0 };
  #drawn_ms = 0;
  #waiting = false;

  constructor(forceBox, pressureBox) {
    this.#readColours();
    const of = (name) => () => this.#colours[name];
    const edge = { stroke: null, width: 0, points: { show: false } };
    const line = (name, more) => ({ stroke: of(name), width: 2, points: { show: false }, ...more });
    const forceCurves = [edge, edge, line("force")];
    const bands = [{ series: [2, 1], fill: of("area") }];
    this.#force = this.#plot(forceBox, forceCurves, forceRange, { bands }, (plot) =>
      drawPeaks(plot, this.#contacts, this.#colours.peak),
    );
    const pressureCurves = [line("pressure"), line("baseline", { width: 1.5, dash: [6, 5] })];
    this.#pressure = this.#plot(pressureBox, pressureCurves, pressureRange, {}, (plot) =>
      drawStars(plot, this.#contacts, this.#colours),
    );
    document.addEventListener("theme", () => this.#recolour());
    setInterval(() => this.#drawSoon(), SILENT_PERIOD_MS);
  }

  #plot(box, curves, range, more, draw) {
    const font = () => parseFloat(getComputedStyle(box).fontSize);
    const axis = (side) => ({
      side,
      stroke: () => this.#colours.ink,
      grid: { stroke: () => this.#colours.grid, width: 1 },
      ticks: { show: false },
      font: `${Math.round(font() * 0.85)}px system-ui, sans-serif`,
    });
    const times = {
      ...axis(2),
      splits: (plot) => this.#ticks(plot),
      values: (plot, at) => agoTexts(plot, at),
      gap: font() * 0.5,
      size: font() * 2.2,
    };
    const options = {
      width: box.clientWidth,
      height: box.clientHeight,
      scales: { x: { time: false, auto: false, range: (plot, low, high) => [low, high] }, y: { range } },
      series: [{}, ...curves],
      axes: [times, { ...axis(3), size: font() * AXIS_WIDTH, space: font() * 2.2, values: numberTexts }],
      legend: { show: false },
      cursor: { show: false },
      padding: [font() * 0.5, font() * 0.9, 0, 0],
      hooks: { draw: [draw] },
      ...more,
    };
    const plot = new uPlot(options, [[], ...curves.map(() => [])], box);
    new ResizeObserver(() => plot.setSize({ width: box.clientWidth, height: box.clientHeight })).observe(box);
    return plot;
  }

  /** Back from now, half as many where there is no room. */
  #ticks({ width, scales: { x } }) {
    const step_s = TICKS_S[this.#span_s] * (width < NARROW ? 2 : 1);
    const count = Math.floor(this.#span_s / step_s) + 1;
    return Array.from({ length: count }, (_, at) => x.max - at * step_s).reverse();
  }

  samples(batch) {
    this.#series.push(banded(batch));
    this.#drawSoon();
  }

  history(batch) {
    this.#series.insert(banded(batch));
    this.#drawSoon();
  }

  /** The host's time now; from then on it runs by itself, whether samples come or not. */
  clock(t_s) {
    this.#clock = { t_s, at_ms: performance.now() };
  }

  contacts(rows) {
    this.#contacts = rows;
    this.#drawSoon();
  }

  span(span_s) {
    this.#span_s = span_s;
    this.#drawn_ms = 0;
    this.#drawSoon();
  }

  #drawSoon() {
    if (this.#waiting) return;
    this.#waiting = true;
    const period_ms = Math.max(LEAST_PERIOD_MS, this.#span_s * 1e3 * PIXEL_OF_S);
    const wait_ms = Math.max(0, this.#drawn_ms + period_ms - performance.now());
    setTimeout(() => requestAnimationFrame(() => this.#draw()), wait_ms);
  }

  #draw() {
    this.#waiting = false;
    this.#drawn_ms = performance.now();
    const [times, low, high, force, pressure, baseline] = this.#series.latest(this.#span_s);
    const clock_s = this.#clock.t_s + (this.#drawn_ms - this.#clock.at_ms) / 1e3;
    const now_s = Math.max(clock_s, times.at(-1) ?? this.#span_s);
    const x = { min: now_s - this.#span_s, max: now_s };
    show(this.#force, [times, low, high, force], x);
    show(this.#pressure, [times, pressure, baseline], x);
  }

  /** Tell the ear what the curves show. */
  describe() {
    const [, , , force, pressure] = this.#series.latest(this.#span_s);
    const span = `over the last ${this.#span_s} s`;
    const label = ({ root }, text) => root.parentElement.setAttribute("aria-label", text);
    label(this.#force, `Curve of the force ${span}: ${between(force, 2, "newtons")}`);
    label(this.#pressure, `Curve of the pressure ${span}: ${between(pressure, 2, "kilopascals")}`);
  }

  #readColours() {
    const colour = (name) => getComputedStyle(document.querySelector(`.${name}`)).color;
    const keys = [
      "force-key",
      "force-area",
      "peak-key",
      "pressure-key",
      "baseline-key",
      "initial-star",
      "final-star",
    ];
    const [force, area, peak, pressure, baseline, initial, final] = keys.map(colour);
    const {
      color: ink,
      borderTopColor: grid,
      outlineColor: edge,
    } = getComputedStyle(document.querySelector(".plot"));
    this.#colours = { force, area, peak, pressure, baseline, initial, final, ink, grid, edge };
  }

  #recolour() {
    this.#readColours();
    this.#drawn_ms = 0;
    this.#drawSoon();
  }
}

/** A batch with the edges of its force's band. */
function banded(batch) {
  const edge = (sign) => (n, at) =>
    n === null || batch.std_n[at] === null ? null : n + sign * 2 * batch.std_n[at];
  return { ...batch, low_n: batch.force_n.map(edge(-1)), high_n: batch.force_n.map(edge(1)) };
}

function show(plot, columns, x) {
  plot.batch(() => {
    plot.setData(columns, false);
    plot.setScale("x", x);
  });
}

const numberTexts = (_, splits) =>
  splits.map((value) => shown(value, splits.some((other) => other % 1) ? 1 : 0));

const agoTexts = ({ scales: { x } }, splits) =>
  splits.map((t_s) => (t_s === x.max ? "now" : `${shown(t_s - x.max, 0)} s`));

function between(values, digits, unit) {
  const known = values.filter((value) => value !== null);
  if (!known.length) return "not available";
  const [low, high] = known.reduce(([l, h], v) => [Math.min(l, v), Math.max(h, v)], [Infinity, -Infinity]);
  return `between ${shown(low, digits)} and ${shown(high, digits)} ${unit}`;
}
