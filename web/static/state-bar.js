// State bar: the state of the rig and the alarms, in the bar that contains VENT and is always in view.

import { byId, setText, showText } from "./elements.js";
import { faultTitle } from "./faults.js";
import { forceAlarmTexts } from "./force-alarm.js";
import { NOT_AVAILABLE, formatName, formatNumber, formatTime } from "./format.js";
import { belowText, isTouchState } from "./touch.js";

const OCCLUSION = 10; // fault of a blocked tube
const STOP_SWITCH = "To vent without this page, press the stop switch at the rig.";

let lastState = null; // a lost connection ends no warning about the tube

/** Show the link, the state and the alarms. `link` is {up, reason, since}; `state` is null if it is unknown. */
export function showStateBar({ link, info, state }) {
  showLinks(link, info, state);
  setText(byId("source"), sourceTag(info, state));
  setText(byId("bar-state"), state ? stateText(state) : "no values");
  setText(byId("summary"), state ? summaryText(state) : NOT_AVAILABLE);
  showFirstOutFault(state?.faults ?? [], info);
  lastState = state ?? lastState;
  showText(byId("tube-unproven"), tubeText(info, lastState));
  showText(byId("force-limit"), forceAlarmTexts(state).bar);
  showText(byId("disconnected"), link.up ? "" : lostText(link));
}

function lostText({ since, reason }) {
  const parts = [`No values since ${formatTime(since)}.`, reason, STOP_SWITCH];
  return parts.filter(Boolean).join(" ");
}

/** Return the state of the rig in words, with a contact or a proof test in progress. */
export function stateText({ state, status }) {
  const isTesting = status.includes("holding") && status.includes("function_check");
  const parts = [
    formatName(state),
    isTesting && "proof test",
    status.includes("in_contact") && "in contact",
  ];
  return parts.filter(Boolean).join(" · ");
}

function showLinks(link, info, state) {
  showChip("link", link.up ? "up" : "down", link.up ? "Page: connected" : "Page: not connected");
  showChip("rig-link", ...rigLink(info, state));
}

function showChip(id, linkState, text) {
  const chip = byId(id);
  chip.dataset.link = linkState;
  setText(chip, text);
}

/** Return the state of the link between the instrument and the rig: up, down or unknown, and its text. */
function rigLink({ replay }, state) {
  if (!state) return ["unknown", "Rig: unknown"];
  if (replay) return ["unknown", "Rig: replay"];
  if (state.state === "boot") return ["down", "Rig: no answer yet"];
  const isSilent = ["stale", "link_lost"].some((name) => state.status.includes(name));
  return isSilent ? ["down", "Rig: no samples"] : ["up", "Rig: connected"];
}

/** Return the source of the values if they are not of a real rig, else "". */
export function sourceTag({ replay, simulated }, state) {
  if (replay) return "REPLAY";
  return simulated || state?.status.includes("simulated") ? "SIMULATED" : "";
}

/** Return true after a blocked tube, until a proof test has passed: no pressure shows an empty balloon. */
export const isTubeUnproven = (state) => Boolean(state?.maintenance_causes?.includes("tube_unproven"));

/**
 * Return a warning about an unproven tube. The fault of a blocked tube contains it already. While another fault
 * is latched, the warning is only its first sentence: the others ask for a hold, which is not possible then.
 */
export function tubeText(info, state) {
  if (!isTubeUnproven(state) || state.faults.includes(OCCLUSION)) return "";
  const text = info.maintenance.tube_unproven ?? "The tube was blocked: look at the balloon.";
  return state.faults.length ? firstSentence(text) : text;
}

/** Show the first fault with the first sentence of its remedy. Its title is a link to the list of faults. */
function showFirstOutFault([first, ...others], info) {
  const box = byId("bar-fault");
  box.dataset.fault = info.faults[first]?.name ?? "";
  box.hidden = first === undefined;
  const more = others.length ? ` (+ ${others.length} more)` : "";
  setText(byId("bar-fault-text"), box.hidden ? "" : `Fault: ${faultTitle(first, info)}${more}`);
  setText(byId("bar-fault-action"), firstSentence(info.faults[first]?.action ?? ""));
}

/** Return the first sentence of a text without backticks. */
const firstSentence = (text) => text.match(/^.*?[.!?](?=\s|$)/s)?.[0].replaceAll("`", "") ?? text;

/** Return force and pressure for the bar. A force below the lower limit is replaced by the limit. */
export function summaryText(state) {
  const { force_n, force_lower_range_limit_n, pressure_kpa } = state;
  const force = isTouchState(state) ? belowText(force_lower_range_limit_n) : formatNumber(force_n, 2);
  return `${force} N   ${formatNumber(pressure_kpa, 2)} kPa`;
}

/** Show force and pressure in the bar while the large force is not completely in view, for example behind the bar. */
export function showSummaryWithoutFigures() {
  const bar = byId("vent");
  let observer;
  const observe = () => {
    const { top, bottom, height } = bar.getBoundingClientRect();
    const covered = top < innerHeight - bottom ? { top: height, bottom: 0 } : { top: 0, bottom: height };
    observer?.disconnect();
    observer = new IntersectionObserver(
      (entries) => (byId("summary").hidden = entries.at(-1).isIntersecting),
      { rootMargin: `-${covered.top}px 0px -${covered.bottom}px`, threshold: 1 },
    );
    observer.observe(byId("force"));
  };
  new ResizeObserver(observe).observe(bar); // each alarm makes the bar higher
}
