// @ts-check
import { font } from './canvas.js';

const WISHED_PX = 130;
/** Height of the bar with its text. */
const HIGH_PX = 24;

/**
 * Draws a round length at the plan's lower left. Returns its place.
 * @param {CanvasRenderingContext2D} context
 * @param {import('./camera.js').Camera} camera
 * @param {string} ink
 */
export function drawScaleBar(context, camera, ink) {
  const length_m = roundLength(WISHED_PX / camera.scale);
  const length_px = length_m * camera.scale;
  const [x, y] = [18, camera.height - 18];
  context.strokeStyle = ink;
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(x, y - 5);
  context.lineTo(x, y);
  context.lineTo(x + length_px, y);
  context.lineTo(x + length_px, y - 5);
  context.stroke();
  context.fillStyle = ink;
  context.font = font(500, 13);
  context.textBaseline = 'alphabetic';
  context.textAlign = 'left';
  context.fillText(length_m < 1 ? `${Math.round(length_m * 1000)} mm` : `${length_m} m`, x + 6, y - 5);
  return { left: x, top: y - HIGH_PX, wide: length_px, high: HIGH_PX };
}

/** The next smaller length of 1, 2 or 5 times a power of ten. @param {number} most_m */
function roundLength(most_m) {
  const power = 10 ** Math.floor(Math.log10(most_m));
  const step = [5, 2, 1].find((factor) => factor * power <= most_m) ?? 1;
  return Number((step * power).toPrecision(1));
}
