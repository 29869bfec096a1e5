// What the paper's Fig. 6 marks: ΔP_i as yellow and ΔP_f as red stars, the peak force as red dashes.

const TIPS = 5;
const INNER = 0.45; // a star's inner radius, of its outer one

/** The yellow star where each contact began from, the red one at its peak, with the contact's number above. */
export function drawStars(plot, contacts, { initial, final, edge, ink }) {
  marking(plot, (at, size) => {
    for (const row of inView(plot, contacts)) {
      star(plot.ctx, ...at(row.initial_s, row.initial_kpa), size, initial, edge);
      const [x, y] = at(row.final_s, row.final_kpa);
      star(plot.ctx, x, y, size * 1.1, final, edge);
      number(plot.ctx, row.number, x, y - size * 1.7, size, ink);
    }
  });
}

/** A dash at the peak of each contact, as long as the contact but to be seen. */
export function drawPeaks(plot, contacts, colour) {
  marking(plot, (at, size) => {
    plot.ctx.strokeStyle = colour;
    plot.ctx.lineWidth = size * 0.35;
    for (const row of inView(plot, contacts)) {
      const [x, y] = at(row.final_s, row.peak_n);
      if (!Number.isFinite(y)) continue;
      plot.ctx.beginPath();
      plot.ctx.moveTo(x - size * 1.6, y);
      plot.ctx.lineTo(x + size * 1.6, y);
      plot.ctx.stroke();
    }
  });
}

function marking(plot, mark) {
  const { ctx, bbox } = plot;
  const at = (t_s, value) => [
    plot.valToPos(t_s, "x", true),
    value === null || value === undefined ? NaN : plot.valToPos(value, "y", true),
  ];
  ctx.save();
  ctx.beginPath();
  const size = parseFloat(getComputedStyle(plot.root).fontSize) * 0.55 * devicePixelRatio;
  ctx.rect(bbox.left, bbox.top, bbox.width + size, bbox.height); // a mark at "now" is seen as a whole
  ctx.clip();
  mark(at, size);
  ctx.restore();
}

const inView = ({ scales: { x } }, contacts) =>
  contacts.filter((row) => row.final_s >= x.min && row.initial_s <= x.max);

function star(ctx, x, y, radius, fill, stroke) {
  if (!Number.isFinite(y)) return;
  ctx.beginPath();
  for (let tip = 0; tip < 2 * TIPS; tip++) {
    const angle = (tip * Math.PI) / TIPS - Math.PI / 2;
    const reach = tip % 2 ? radius * INNER : radius;
    ctx.lineTo(x + reach * Math.cos(angle), y + reach * Math.sin(angle));
  }
  ctx.closePath();
  ctx.fillStyle = fill;
  ctx.strokeStyle = stroke;
  ctx.lineWidth = Math.max(1, radius / 6);
  ctx.fill();
  ctx.stroke();
}

function number(ctx, text, x, y, size, colour) {
  if (!Number.isFinite(y)) return;
  ctx.font = `${size * 1.5}px system-ui, sans-serif`;
  ctx.textAlign = "center";
  ctx.fillStyle = colour;
  ctx.fillText(text, x, y);
}
