// The question before something moves. VENT stays in reach: all else that can be pressed rests meanwhile.

import { byId, say } from "./elements.js";

let answer = null;

/** Ask in a dialog; true where the answer is yes. A question that is still open is answered no. */
export function confirmed(title, text, yes) {
  dismiss();
  say(byId("confirm-title"), title);
  say(byId("confirm-text"), text);
  say(byId("confirm-yes"), yes);
  const before = document.activeElement;
  show(true);
  byId("confirm-no").focus();
  return new Promise((resolve) => {
    answer = (isYes) => {
      answer = null;
      show(false);
      before?.focus();
      resolve(isYes);
    };
  });
}

/** Answer an open question with no: what it said no longer holds. */
export const dismiss = () => answer?.(false);

function show(isOpen) {
  byId("confirm").hidden = !isOpen;
  for (const part of document.querySelectorAll("main, footer, .skip")) part.inert = isOpen;
}

/** Listen to the dialog's buttons, to Escape, and to a vent by whatever way. */
export function startConfirm() {
  byId("confirm-yes").addEventListener("click", () => answer?.(true));
  byId("confirm-no").addEventListener("click", dismiss);
  addEventListener("keydown", ({ key }) => key === "Escape" && dismiss());
  document.addEventListener("vent-asked", dismiss);
}
