// VENT: alone in its module, which imports nothing, so that it works whatever else fails.

const PATIENCE_MS = 3000;
const VERIFIED_WITHIN_MS = 10000;
const BY_HAND = "use the rig’s stop switch: valves without current vent.";
const UNVERIFIED = "The vent was accepted, but nothing shows that the balloon is vented";

const form = document.getElementById("vent");
const said = document.getElementById("vent-said");
const failed = document.getElementById("vent-failed");
const time = () => new Date().toLocaleTimeString("en-GB");
const isReplay = () => document.body.classList.contains("replay");

let pressed = 0;
let unverified = 0;

/** Ask for a vent, and say what became of it: never silent. Others of the page hear of it as events. */
async function vent() {
  const mine = ++pressed;
  document.dispatchEvent(new Event("vent-asked"));
  tell("Vent asked …", "");
  const why = await refusalOf(ask());
  if (!why) document.dispatchEvent(new Event("vent-accepted"));
  if (mine !== pressed) return;
  if (why) return fail(`NOT VENTED at ${time()}: ${why} ${remedyBeside(why)}`);
  if (isReplay()) return tell("Accepted; a replay has nothing to vent.", "");
  tell(`Accepted ${time()}, venting …`, "");
  clearTimeout(unverified);
  unverified = setTimeout(() => {
    unverified = 0;
    fail(`${UNVERIFIED}: ${BY_HAND}`);
  }, VERIFIED_WITHIN_MS);
}

const ask = () =>
  fetch("/api/vent", {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: "{}",
    keepalive: true,
    priority: "high",
    signal: AbortSignal.timeout(PATIENCE_MS),
  });

/** Why it was not done, as a sentence; "" where it was. */
async function refusalOf(asked) {
  try {
    const response = await asked;
    const answer = await response.json().catch(() => ({}));
    if (response.ok && answer.refusal === "none") return "";
    return sentence(
      answer.text ?? answer.why ?? `the instrument answered “${answer.refusal ?? response.status}”`,
    );
  } catch (error) {
    return error.name === "TimeoutError"
      ? `no answer within ${PATIENCE_MS / 1e3} s.`
      : "the page’s server cannot be reached.";
  }
}

const remedyBeside = (why) =>
  why.includes("stop switch") ? "Or press again." : `Press again, or ${BY_HAND}`;

const sentence = (text) => (/[.!?]$/.test(text) ? text : `${text}.`);

function tell(text, alarm) {
  said.textContent = text;
  said.dataset.bad = alarm !== "";
  failed.textContent = alarm;
  failed.hidden = !alarm;
}

function fail(text) {
  clearTimeout(unverified);
  unverified = 0;
  tell("NOT VENTED", text);
}

form.addEventListener("submit", (event) => {
  event.preventDefault();
  vent();
});

// The letter where the layout has Latin ones, else its place: Option+V types another sign on a Mac.
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

document.addEventListener("instrument-state", ({ detail }) => {
  const vented = !isReplay() && detail?.status?.includes("vented");
  if ((unverified || !failed.hidden) && vented) {
    clearTimeout(unverified);
    unverified = 0;
    tell(`Vented, verified ${time()}.`, "");
  } else if (!unverified && detail && !vented && said.textContent.startsWith("Vented")) tell("", "");
});
