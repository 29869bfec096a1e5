// Panel of the plots: time span, pause, values at the pointer, and download.

import { byId, create, setText, showText } from "./elements.js";
import { NOT_AVAILABLE, formatNumber } from "./format.js";
import { formatClock } from "./plot-ticks.js";
import { valueTexts } from "./plot-values.js";
import { saveText } from "./samples-csv.js";

const LABEL_PERIOD_MS = 2000;
const READ_KEY_MS = 500; // time in which a change of the values is that of the last key
const HINT = "Point at a plot to read its values. Drag, or pinch with two fingers, to zoom.";

/**
 * Return the plots; null in the compact view. The page works without plots if their file cannot be loaded.
 * `getInfo()` returns the facts about the instrument.
 */
export async function startPlotPanel(getInfo) {
  if (document.documentElement.dataset.view === "compact") return null;
  const module = await import("./plots.js").catch(() => null);
  byId("plot-tools").hidden = module === null;
  if (module === null) return null;
  const plots = new module.Plots(byId("force-plot"), byId("pressure-plot"), {
    onSample: (sample) =>
      showValues(sample && valueTexts(sample, plots.clock_s, getInfo().board_states ?? {})),
    onWindow: (timeWindow) => showWindow(timeWindow, plots.clock_s),
  });
  for (const choice of document.querySelectorAll("input[name=span]")) {
    choice.addEventListener("change", () => plots.setSpan(Number(choice.value)));
    if (choice.checked) plots.setSpan(Number(choice.value)); // browsers restore the choice after a reload
  }
  const pauseButton = byId("plots-pause");
  pauseButton.addEventListener("click", () =>
    pauseButton.dataset.paused === "true" ? plots.resume() : plots.pause(),
  );
  byId("plots-unzoom").addEventListener("click", () => plots.unzoom());
  byId("plots-save").addEventListener("click", () => save(plots));
  setInterval(() => plots.updateLabels(), LABEL_PERIOD_MS);
  announceOnlyKeys();
  showValues(null);
  return plots;
}

/** Show the limits of the force [N] of a state in the legend, and the alarm limit in the plot. */
export function showLimits(plots, state) {
  const { force_limit_n = NaN, force_lower_range_limit_n } = state ?? {};
  setText(byId("limit-in-effect"), `${formatNumber(force_limit_n, 2)} N`);
  const lower = formatNumber(force_lower_range_limit_n, 2);
  setText(byId("lower-limit"), lower === NOT_AVAILABLE ? "the lower limit" : `${lower} N`);
  plots?.setLimit(force_limit_n);
}

/** Let screen readers read the values after a key only. In live plots and with a mouse, they always change. */
function announceOnlyKeys() {
  const values = byId("plot-values");
  let timer = 0;
  byId("plots").addEventListener("keydown", () => {
    values.setAttribute("aria-live", "polite");
    clearTimeout(timer);
    timer = setTimeout(() => values.setAttribute("aria-live", "off"), READ_KEY_MS);
  });
}

function showValues(texts) {
  const box = byId("plot-values");
  box.classList.toggle("muted", texts === null);
  if (texts === null) return void setText(box, HINT);
  if (box.children.length !== texts.length) box.replaceChildren(...texts.map(() => create("span")));
  texts.forEach((text, index) => setText(box.children[index], text));
}

function showWindow(timeWindow, offset_s) {
  const { isLive, isZoomed } = timeWindow;
  const button = byId("plots-pause");
  button.dataset.paused = String(!isLive);
  setText(button, isLive ? "Pause" : "Resume");
  byId("plots").classList.toggle("paused", !isLive);
  byId("plots-unzoom").hidden = !isZoomed;
  const { max } = isLive ? { max: NaN } : timeWindow.range(NaN);
  const until = isLive ? "" : formatClock(max + offset_s, 0);
  showText(byId("plots-paused"), isLive ? "" : `PAUSED: values until ${until}`);
}

function save(plots) {
  const { text, first_utc_s } = plots.csv();
  const time = Number.isFinite(first_utc_s) ? new Date(first_utc_s * 1e3).toISOString() : "no-samples";
  saveText(text, `pneuforce-${time.replaceAll(/[-:]|\.\d+/g, "")}.csv`, "text/csv");
}
