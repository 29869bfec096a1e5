// One plot of uPlot, with a vertical line at the pointer and a box for the part that is selected.

import uPlot from "./vendor/uPlot.esm.js";
import { create } from "./elements.js";
import { formatNumber } from "./format.js";

const AXIS_WIDTH_EM = 3.4;

/**
 * Return a plot in `box`.
 *
 * `curves` and `bands` have the format of uPlot, `range(low, high)` returns the range of the vertical axis,
 * `ticks(plot)` and `labels(plot, ticks)` are for the time axis, and `draw(plot)` draws marks.
 */
export function createPlot(box, { curves, bands = [], range, ticks, labels, draw, colours }) {
  const em = () => parseFloat(getComputedStyle(box).fontSize);
  const axis = (side) => ({
    side,
    stroke: () => colours().ink,
    grid: { stroke: () => colours().grid, width: 1 },
    ticks: { show: false },
    font: `${Math.round(em() * 0.85)}px system-ui, sans-serif`,
  });
  const times = { ...axis(2), splits: ticks, values: labels, gap: em() * 0.5, size: em() * 2.2 };
  const values = { ...axis(3), size: em() * AXIS_WIDTH_EM, space: em() * 2.2, values: numberLabels };
  const options = {
    width: box.clientWidth,
    height: box.clientHeight,
    scales: {
      x: { time: false, auto: false, range: (_, low, high) => [low, high] },
      y: { range: (_, low, high) => range(low, high) },
    },
    series: [{}, ...curves],
    bands,
    axes: [times, values],
    legend: { show: false },
    cursor: { show: false },
    padding: [em() * 0.5, em() * 0.9, 0, 0],
    hooks: { draw: [draw] },
  };
  const plot = new uPlot(options, [[], ...curves.map(() => [])], box);
  plot.over.append(create("div", "plot-selection"), create("div", "plot-cursor"));
  new ResizeObserver(() => plot.setSize({ width: box.clientWidth, height: box.clientHeight })).observe(box);
  return plot;
}

/** Replace the data of a plot, and the range {min, max} of the time axis. */
export function setData(plot, columns, x) {
  plot.batch(() => {
    plot.setData(columns, false);
    plot.setScale("x", x);
  });
}

/** Show the line at a position from 0 (left) to 1 (right); null hides the line. */
export function showCursor({ over }, position) {
  const line = over.querySelector(".plot-cursor");
  line.hidden = position === null;
  line.style.left = `${position * 100}%`;
}

/** Show the selected part [from, to], positions from 0 to 1; null hides the selection. */
export function showSelection({ over }, part) {
  const selection = over.querySelector(".plot-selection");
  selection.hidden = part === null;
  if (!part) return;
  selection.style.left = `${part[0] * 100}%`;
  selection.style.width = `${(part[1] - part[0]) * 100}%`;
}

const numberLabels = (_, ticks) =>
  ticks.map((value) => formatNumber(value, ticks.some((other) => other % 1) ? 1 : 0));
