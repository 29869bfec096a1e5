// Pointer and keys on a plot. Positions are numbers from 0 (left edge of the plot area) to 1 (right edge).

const MIN_DRAG_PX = 6; // a shorter movement is a click
const KEY_STEP = 0.005;
const KEY_LARGE_STEP = 0.05;

/**
 * Call the handlers when a person points at the plot, drags over it, or pinches it.
 *
 * - `onPoint(position)`: the pointer is here; null if the mouse has left the plot.
 * - `onSelect(part)`: the part [from, to] is selected so far; null if the selection is cancelled.
 * - `onZoom(part)`: the part was selected.
 * - `onPinchStart()`, `onPinch(before, now)`: two fingers have moved from two positions to two others.
 * - `onReset()`: double click.
 */
export function followPointer(over, handlers) {
  const touches = new Map(); // finger → position
  let dragStart = null;
  let pinchStart = null;
  const positionOf = ({ clientX }) => {
    const { left, width } = over.getBoundingClientRect();
    return Math.min(1, Math.max(0, (clientX - left) / width));
  };
  const sorted = (a, b) => (a < b ? [a, b] : [b, a]);
  const fingers = () => sorted(...touches.values());

  const down = (event) => {
    const position = positionOf(event);
    over.setPointerCapture(event.pointerId);
    if (event.pointerType !== "touch") return void (dragStart = event.button === 0 ? position : null);
    touches.set(event.pointerId, position);
    pinchStart = touches.size === 2 ? fingers() : null;
    if (pinchStart) handlers.onPinchStart();
    else handlers.onPoint(position);
  };
  const move = (event) => {
    const position = positionOf(event);
    if (touches.has(event.pointerId)) touches.set(event.pointerId, position);
    if (pinchStart) return handlers.onPinch(pinchStart, fingers());
    handlers.onPoint(position);
    if (dragStart !== null) handlers.onSelect(sorted(dragStart, position));
  };
  const end = (event) => {
    touches.delete(event.pointerId);
    if (touches.size < 2) pinchStart = null;
    if (dragStart === null) return;
    const part = sorted(dragStart, positionOf(event));
    dragStart = null;
    handlers.onSelect(null);
    const isDrag = (part[1] - part[0]) * over.clientWidth >= MIN_DRAG_PX;
    if (isDrag && event.type === "pointerup") handlers.onZoom(part);
  };
  over.addEventListener("pointerdown", down);
  over.addEventListener("pointermove", move);
  over.addEventListener("pointerup", end);
  over.addEventListener("pointercancel", end);
  over.addEventListener("dblclick", () => handlers.onReset());
  over.addEventListener("pointerleave", ({ pointerType }) => {
    if (pointerType !== "touch" && dragStart === null) handlers.onPoint(null);
  });
}

/**
 * Call the handlers for the keys of a plot that has the focus.
 *
 * - `onStep(step)`: an arrow key moves the line by this part of the plot (with Shift by ten times the part).
 * - `onScale(factor)`: the keys + and − change the duration of the time axis by this factor.
 * - `onReset()`: Escape.
 */
export function followKeys(box, { onStep, onScale, onReset }) {
  box.addEventListener("keydown", (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const step = event.shiftKey ? KEY_LARGE_STEP : KEY_STEP;
    const actions = {
      ArrowLeft: () => onStep(-step),
      ArrowRight: () => onStep(step),
      "+": () => onScale(0.5),
      "-": () => onScale(2),
      Escape: onReset,
    };
    if (!actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  });
}
