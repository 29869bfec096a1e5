// Confirmation dialog before the balloon moves. While the dialog is open, only VENT and the dialog work.

import { byId, setText } from "./elements.js";

let close = null;

/** Open the dialog and return a promise of the answer. A dialog that is already open is cancelled. */
export function askConfirmation(title, text, confirmLabel) {
  cancelConfirmation();
  setText(byId("confirm-title"), title);
  setText(byId("confirm-text"), text);
  setText(byId("confirm-yes"), confirmLabel);
  const previousFocus = document.activeElement;
  show(true);
  byId("confirm-no").focus();
  return new Promise((resolve) => {
    close = (isConfirmed) => {
      close = null;
      show(false);
      previousFocus?.focus();
      resolve(isConfirmed);
    };
  });
}

/** Cancel an open dialog. */
export const cancelConfirmation = () => close?.(false);

function show(isOpen) {
  byId("confirm").hidden = !isOpen;
  for (const part of document.querySelectorAll("main, footer, .skip")) part.inert = isOpen;
}

/** Connect the buttons of the dialog. Escape and every vent cancel the dialog. */
export function startConfirmation() {
  byId("confirm-yes").addEventListener("click", () => close?.(true));
  byId("confirm-no").addEventListener("click", cancelConfirmation);
  addEventListener("keydown", ({ key }) => key === "Escape" && cancelConfirmation());
  document.addEventListener("vent-requested", cancelConfirmation);
}
