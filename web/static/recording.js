// Panel of the recordings: start, stop, state and download. The recording runs in a process of the instrument.

import { byId, create, setText, showText } from "./elements.js";
import { formatBytes, formatElapsed } from "./format.js";
import { recordingBlockedBy } from "./permissions.js";
import { post } from "./requests.js";

const START_TIMEOUT_MS = 20000;

/** Conditions of start and stop: code, predicate, and the text if the predicate is false. */
const CONDITIONS = [
  ["disconnected", ({ link }) => link.up, "Not connected to the instrument."],
  [
    "recordings_disabled",
    ({ recording }) => recording?.enabled,
    "Recordings are disabled. Set recordings in [web] in the configuration.",
  ],
  ["replay", ({ info }) => !info.replay, "A replay cannot be recorded."],
];

/** Panel of the recordings. `getModel()` returns the current link, info and session. */
export class RecordingPanel {
  #getModel;
  #recording = null; // the latest message of the web server
  #isRequested = false; // a request waits for its answer

  constructor(getModel) {
    this.#getModel = getModel;
    byId("record-button").addEventListener("click", () => this.#startOrStop());
    byId("recordings").addEventListener("click", ({ target }) => {
      if (target.dataset.file) this.#download(target.dataset.file);
    });
  }

  /** Show a message of the web server. */
  show(recording) {
    this.#recording = recording;
    this.update();
  }

  /** Update the panel from the current link and session. */
  update() {
    const active = this.#recording?.active;
    const { link } = this.#getModel();
    const blocked = this.#blocked();
    const button = byId("record-button");
    setText(button, active ? "Stop recording" : "Start recording");
    button.dataset.active = String(Boolean(active));
    button.setAttribute("aria-disabled", String(Boolean(blocked) || this.#isRequested));
    showText(byId("record-reason"), blocked?.text ?? "");
    byId("record-reason").dataset.code = blocked?.code ?? "";
    showText(byId("record-active"), active ? activeText(active, link) : "");
    this.#showLast();
    this.#showFinished();
  }

  #blocked() {
    const model = { ...this.#getModel(), recording: this.#recording };
    const blocking = CONDITIONS.find(([, holds]) => !holds(model));
    return blocking ? { code: blocking[0], text: blocking[2] } : recordingBlockedBy(model);
  }

  #showLast() {
    const last = this.#recording?.last;
    const box = byId("record-last");
    showText(box, last ? `${extentText(last)}. Ended: ${last.text}.\n${last.file}` : "");
    box.dataset.error = String(last?.complete === false);
  }

  #showFinished() {
    const files = this.#recording?.finished ?? [];
    byId("recordings-title").hidden = !files.length;
    const list = byId("recordings");
    const names = files.map(({ file }) => file).join();
    if (list.dataset.names !== names) {
      list.dataset.names = names;
      list.replaceChildren(...files.map(listItem));
    }
    const blocked = String(Boolean(this.#blocked()));
    for (const button of list.querySelectorAll("button")) button.setAttribute("aria-disabled", blocked);
  }

  async #startOrStop() {
    if (this.#isRequested || this.#blocked()) return;
    const action = this.#recording.active ? "stop" : "start";
    this.#isRequested = true;
    this.#showError("");
    this.update();
    const { status, answer } = await post(`/api/recording/${action}`, {}, START_TIMEOUT_MS);
    if (status === 401) this.#getModel().session.expire();
    this.#showError(status === 200 ? "" : answer.text);
    this.#isRequested = false;
    this.update();
  }

  #download(file) {
    const blocked = this.#blocked();
    if (blocked) return this.#showError(blocked.text);
    const link = create("a");
    link.href = `/api/recordings/${encodeURIComponent(file)}`;
    link.download = file;
    link.click();
  }

  #showError(text) {
    showText(byId("record-error"), text ?? "");
  }
}

function activeText(active, link) {
  if (active.seconds === null) return link.up ? "Starting. Wait until the recording begins." : "";
  const title = link.up ? "● Recording" : "Last known: recording";
  return `${title}: ${extentText(active)}\n${active.file}`;
}

const extentText = ({ seconds, bytes }) =>
  seconds === null ? "no data" : `${formatElapsed(seconds)}, ${formatBytes(bytes)}`;

function listItem({ file, bytes }) {
  const button = create("button", "", "Save");
  button.type = "button";
  button.dataset.file = file;
  button.setAttribute("aria-label", `Save ${file}`);
  const name = create("span", "", file.replace(/\.recording$/, ""));
  return create("li", "", name, create("span", "size", formatBytes(bytes)), button);
}
