// Confirmation dialog before the balloon moves. While the dialog is open, only VENT and the dialog work.

import { byId, setText } from "./elements.js";

const MIN_HEIGHT_PX = 130; // in less free space, the dialog covers the alarms, too, but never VENT

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
  place();
  for (const part of document.querySelectorAll("main, footer, .skip")) part.inert = isOpen;
}

/** Keep the dialog in the part of the window that the bar with VENT and the alarms leaves free. */
function place() {
  const dialog = byId("confirm");
  let [begin, end] = freeBeside(byId("vent"));
  const isOverAlarms = end - begin < MIN_HEIGHT_PX;
  if (isOverAlarms) [begin, end] = freeBeside(byId("vent-button"));
  dialog.classList.toggle("over-alarms", isOverAlarms);
  dialog.style.inset = `${begin}px 0 ${innerHeight - end}px`;
  dialog.style.maxHeight = `${end - begin - 8}px`;
}

/** Return begin and end of the larger part of the window, above or below an element [px]. */
function freeBeside(element) {
  const { top, bottom } = element.getBoundingClientRect();
  return top < innerHeight - bottom ? [bottom, innerHeight] : [0, top];
}

/** Connect the buttons of the dialog. Escape and every vent cancel the dialog. */
export function startConfirmation() {
  byId("confirm-yes").addEventListener("click", () => close?.(true));
  byId("confirm-no").addEventListener("click", cancelConfirmation);
  addEventListener("keydown", ({ key }) => key === "Escape" && cancelConfirmation());
  document.addEventListener("vent-requested", cancelConfirmation);
  addEventListener("resize", place);
  new ResizeObserver(place).observe(byId("vent")); // an alarm makes the bar higher
}
