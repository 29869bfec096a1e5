// Title of the tab: the most important alarm, or the force and the state.

import { PAGE_HIDDEN } from "./event-stream.js";
import { faultTitle } from "./faults.js";
import { forceAlarmTexts } from "./force-alarm.js";
import { formatNumber } from "./format.js";
import { isTubeUnproven, sourceTag, stateText } from "./state-bar.js";

/**
 * Return the title. `ventAlarm` is the alarm about a failed vent, "" if there is none.
 *
 * A force below the lower range limit is not shown, because the title has no place for the reason.
 */
export function titleText({ link, info, state }, ventAlarm) {
  if (link.reason === PAGE_HIDDEN) return "not connected · pneuforce"; // another tab shows the values
  const alarm = alarmText(info, state, ventAlarm);
  const parts = alarm ? [`⚠ ${alarm}`] : [forceText(state), stateText(state)];
  return [...parts, sourceTag(info, state), "pneuforce"].filter(Boolean).join(" · ");
}

function alarmText(info, state, ventAlarm) {
  if (ventAlarm) return ventAlarm.match(/^[A-Z ]+\b/)?.[0] ?? ventAlarm;
  if (!state) return "no values";
  if (state.faults.length) return faultTitle(state.faults[0], info);
  return forceAlarmTexts(state).title || (isTubeUnproven(state) ? "the tube was blocked" : "");
}

const forceText = ({ force_n, status }) =>
  Number.isFinite(force_n) && !status.includes("interpolated") ? `${formatNumber(force_n, 1)} N` : "";
