// VENT. This module imports nothing, so that VENT works even if another script fails.

const TIMEOUT_MS = 3000;
const VERIFY_TIMEOUT_MS = 10000;
const DO_NOT_PULL = "The balloon may be inflated: do not pull it out.";
const VENT_FAULT = `NOT VENTED. ${DO_NOT_PULL} Press the stop switch at the rig.`;
const NOT_VERIFIED =
  `NOT VERIFIED: no report of an empty balloon within ${VERIFY_TIMEOUT_MS / 1e3} s. ` +
  "Press the stop switch at the rig.";
const NOT_ZEROED =
  "NOT VERIFIED: the pressure sensor has no zero, and a fault is latched. If the balloon is inflated, press the " +
  "stop switch at the rig. Otherwise clear the faults, and press VENT again.";
const TUBE_UNPROVEN =
  "NOT VERIFIED: the tube was blocked, so the balloon may be inflated although the sensor reads no pressure. " +
  "Look at the balloon, and do not pull it out while it is inflated.";
const RIG_LOST =
  "NOT VERIFIED: the instrument receives no samples from the rig. Press the stop switch at the rig.";

const form = document.getElementById("vent");
const status = document.getElementById("vent-status");
const failed = document.getElementById("vent-failed");
const timeOfDay = () => new Date().toLocaleTimeString("en-GB");
const isReplay = () => document.body.classList.contains("replay");

let requestCount = 0;
let verifyTimer = 0;
let request = { state: "", text: "", alarm: "" }; // the last request for a vent, and why it failed
let acceptedAt = ""; // time of day
let isVentFault = false; // true while the instrument reports that a vent failed
let isRigLost = false; // true while the instrument reports that no samples arrive
let isZeroPrevented = false; // true while the sensor has no zero, and a latched fault prevents it
let hasValues = false; // false while the page has no connection to the instrument

/** Request a vent and show the result. Other modules are informed with DOM events. */
async function vent() {
  const number = ++requestCount;
  document.dispatchEvent(new Event("vent-requested"));
  show("requested", "Vent requested …");
  const { error, t_s } = await resultOf(sendRequest());
  if (!error) document.dispatchEvent(new CustomEvent("vent-accepted", { detail: t_s }));
  if (number !== requestCount) return;
  stopTimer();
  if (error) return show("failed", "", `NOT VENTED at ${timeOfDay()}: ${error} ${remedy(error)}`);
  if (isReplay()) return show("accepted", "Accepted. A replay has no balloon to vent.");
  acceptedAt = timeOfDay();
  showAccepted();
  if (isVentFault) return;
  if (isRigLost) return show("failed", "", RIG_LOST);
  verifyTimer = setTimeout(() => {
    verifyTimer = 0;
    show("failed", "", isZeroPrevented ? NOT_ZEROED : NOT_VERIFIED);
  }, VERIFY_TIMEOUT_MS);
}

/** Send the request. Send it again if the connection fails, because the server may close an idle connection. */
const sendRequest = () =>
  postVent().catch((error) => (error.name === "TimeoutError" ? Promise.reject(error) : postVent()));

const postVent = () =>
  fetch("/api/vent", {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: "{}",
    keepalive: true,
    priority: "high",
    signal: AbortSignal.timeout(TIMEOUT_MS),
  });

/** Return the reason why the vent failed as a sentence; "" with the time of the vent if it was accepted. */
async function resultOf(request) {
  try {
    const response = await request;
    const answer = await response.json().catch(() => ({}));
    if (response.ok && answer.reject_reason === "none") return { error: "", t_s: answer.t_s };
    const text = answer.text ?? `The instrument answered “${answer.reject_reason ?? response.status}”`;
    return { error: asSentence(text) };
  } catch ({ name }) {
    return name === "TimeoutError"
      ? { error: `The web server did not answer within ${TIMEOUT_MS / 1e3} s.` }
      : { error: "The web server could not be reached." };
  }
}

const remedy = (error) =>
  error.includes("stop switch") ? "" : "Press VENT again, or the stop switch at the rig.";

const asSentence = (text) => (/[.!?]$/.test(text) ? text : `${text}.`);

/** Show the status of the request, and an alarm if there is one. `state` is for the style and the tests. */
function show(state, text, alarm = "") {
  request = { state, text, alarm };
  draw();
}

function showAccepted() {
  const result = hasValues ? ", venting …" : ". The result is unknown: the page has no values.";
  show("accepted", `Accepted ${acceptedAt}${result}`);
}

/** Show the last request, or a vent fault, which no later request hides. Without values, show both. */
function draw() {
  const isUnanswered = !hasValues && request.alarm.startsWith("NOT VENTED at");
  const fault = isUnanswered ? `${request.alarm} ${DO_NOT_PULL}` : VENT_FAULT;
  const alarm = isVentFault ? fault : request.alarm;
  status.textContent = alarm ? "" : request.text;
  status.dataset.state = alarm ? "failed" : request.state;
  if (failed.textContent !== alarm) failed.textContent = alarm; // a text that is set again is read again
  failed.hidden = !alarm;
}

function stopTimer() {
  clearTimeout(verifyTimer);
  verifyTimer = 0;
}

form.addEventListener("submit", (event) => {
  event.preventDefault();
  vent();
});

// Compare the letter if the key types a Latin letter, else the position of the key. On a Mac, for example,
// Option+V types a different character.
const isV = ({ key, code }) => (/^[a-z]$/i.test(key) ? key.toLowerCase() === "v" : code === "KeyV");

addEventListener(
  "keydown",
  (event) => {
    if (!event.altKey || event.ctrlKey || event.metaKey || event.repeat || !isV(event)) return;
    event.preventDefault();
    vent();
  },
  { capture: true },
);

document.addEventListener("instrument-state", ({ detail: state }) => {
  if (isReplay()) return;
  const hadValues = hasValues;
  hasValues = Boolean(state);
  if (verifyTimer && hasValues !== hadValues) showAccepted();
  if (!state) return showLastKnown();
  const wasVentFault = isVentFault;
  isVentFault = state.status.includes("vent_fault");
  if (isVentFault) {
    stopTimer();
    return draw();
  }
  isZeroPrevented = state.faults.length > 0 && state.status.includes("not_zeroed");
  isRigLost = state.state === "boot" || state.status.includes("link_lost");
  const isVented = state.status.includes("vented");
  const isUnproven = Boolean(state.maintenance_causes?.includes("tube_unproven"));
  const isShown = ["verified", "last-known"].includes(request.state) || request.alarm === TUBE_UNPROVEN;
  if (isVented && isUnproven && (verifyTimer || request.alarm || isShown)) {
    stopTimer();
    show("failed", "", TUBE_UNPROVEN);
  } else if (isVented && (verifyTimer || request.alarm || request.state === "last-known")) {
    stopTimer();
    show("verified", `Vented ${timeOfDay()}: the sensor reads no pressure. Look at the balloon.`);
  } else if (verifyTimer && isRigLost) {
    stopTimer();
    show("failed", "", RIG_LOST);
  } else if (wasVentFault || (!verifyTimer && !isVented && isShown)) show("", "");
});

/** Replace the text about a verified vent, because the page no longer knows the pressure. */
function showLastKnown() {
  isRigLost = false;
  if (request.state === "verified")
    show("last-known", `Last known at ${timeOfDay()}: vented, the sensor read no pressure.`);
  draw();
}
