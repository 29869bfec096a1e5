// Marks of contacts in the plots, as in Fig. 6 of the paper: ΔP_i as yellow stars, ΔP_f as red stars,
// and the peak force as red dashes. A peak below the lower limit of measurement is grey.

import { isTouchContact } from "./touch.js";

const TIPS = 5;
const INNER_RADIUS = 0.45; // relative to the outer radius

/** Draw a yellow star at ΔP_i of each contact, a red star at ΔP_f, and the number of the contact above. */
export function drawStars(plot, contacts, { initial, final, edge, ink }) {
  drawMarks(plot, (position, size) => {
    for (const row of visibleContacts(plot, contacts)) {
      drawStar(plot.ctx, ...position(row.initial_s, row.baseline_kpa), size, initial, edge);
      const [x, y] = position(row.final_s, row.final_kpa);
      drawStar(plot.ctx, x, y, size * 1.1, final, edge);
      drawNumber(plot.ctx, row.number, x, y - size * 1.7, size, ink);
    }
  });
}

/** Draw a dash of fixed length at the peak force of each contact. */
export function drawPeaks(plot, contacts, { peak, touch }) {
  drawMarks(plot, (position, size) => {
    plot.ctx.lineWidth = size * 0.35;
    for (const row of visibleContacts(plot, contacts)) {
      const [x, y] = position(row.final_s, row.peak_n);
      if (!Number.isFinite(y)) continue;
      plot.ctx.strokeStyle = isTouchContact(row) ? touch : peak;
      plot.ctx.beginPath();
      plot.ctx.moveTo(x - size * 1.6, y);
      plot.ctx.lineTo(x + size * 1.6, y);
      plot.ctx.stroke();
    }
  });
}

/** Call `draw(position, size)` with the canvas clipped to the plot area. */
function drawMarks(plot, draw) {
  const { ctx, bbox } = plot;
  const position = (t_s, value) => [
    plot.valToPos(t_s, "x", true),
    value === null || value === undefined ? NaN : plot.valToPos(value, "y", true),
  ];
  ctx.save();
  ctx.beginPath();
  const size = parseFloat(getComputedStyle(plot.root).fontSize) * 0.55 * devicePixelRatio;
  ctx.rect(bbox.left, bbox.top, bbox.width + size, bbox.height); // wider, so that a mark at "now" is complete
  ctx.clip();
  draw(position, size);
  ctx.restore();
}

const visibleContacts = ({ scales: { x } }, contacts) =>
  contacts.filter((row) => row.final_s >= x.min && row.initial_s <= x.max);

function drawStar(ctx, x, y, radius, fill, stroke) {
  if (!Number.isFinite(y)) return;
  ctx.beginPath();
  for (let tip = 0; tip < 2 * TIPS; tip++) {
    const angle = (tip * Math.PI) / TIPS - Math.PI / 2;
    const distance = tip % 2 ? radius * INNER_RADIUS : radius;
    ctx.lineTo(x + distance * Math.cos(angle), y + distance * Math.sin(angle));
  }
  ctx.closePath();
  ctx.fillStyle = fill;
  ctx.strokeStyle = stroke;
  ctx.lineWidth = Math.max(1, radius / 6);
  ctx.fill();
  ctx.stroke();
}

function drawNumber(ctx, text, x, y, size, colour) {
  if (!Number.isFinite(y)) return;
  ctx.font = `${size * 1.5}px system-ui, sans-serif`;
  ctx.textAlign = "center";
  ctx.fillStyle = colour;
  ctx.fillText(text, x, y);
}
