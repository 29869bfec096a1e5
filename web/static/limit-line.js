// Line of the alarm limit in the plot of the force.

/** Draw a dashed line at the alarm limit [N] if the axis contains the limit. */
export function drawLimit({ ctx, bbox, valToPos, scales: { y } }, limit_n, colour) {
  if (!(limit_n >= y.min && limit_n <= y.max)) return;
  const height = valToPos(limit_n, "y", true);
  ctx.save();
  ctx.strokeStyle = colour;
  ctx.lineWidth = 1.5 * devicePixelRatio;
  ctx.setLineDash([8 * devicePixelRatio, 4 * devicePixelRatio]);
  ctx.beginPath();
  ctx.moveTo(bbox.left, height);
  ctx.lineTo(bbox.left + bbox.width, height);
  ctx.stroke();
  ctx.restore();
}
