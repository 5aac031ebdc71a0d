// @ts-check
// The grid: points that are drawn and dragged snap to it, unless Alt is held.

import { element } from './element.js';
import { ofBrowser } from './storage.js';

/** Least distance of the drawn lines, in pixels. */
const LEAST_PX = 14;
const OPACITY = 0.5;

const select = element('snap', HTMLSelectElement);
const kept = ofBrowser('bench-dragon.plan-snap');

/** The step of the grid in metres; 0 without one. */
export const snap_m = () => Number(select.value);

/** @param {() => void} changed */
export function listenToSnap(changed) {
  const before = kept.read();
  if (before !== null && [...select.options].some(({ value }) => value === before)) select.value = before;
  select.addEventListener('change', () => {
    kept.write(select.value);
    changed();
  });
}

/** @param {[number, number]} place @param {boolean} isFree @returns {[number, number]} */
export function snapped([x, y], isFree) {
  const step = snap_m();
  if (step === 0 || isFree) return [x, y];
  // Decimals that people would type.
  const onGrid = (/** @type {number} */ value) => Number((Math.round(value / step) * step).toFixed(6));
  return [onGrid(x), onGrid(y)];
}

/** Draws the grid. Lines that would be too near to each other are left out. @param {CanvasRenderingContext2D} context @param {import('./camera.js').Camera} camera @param {string} colour */
export function drawGrid(context, camera, colour) {
  let step = snap_m();
  if (step === 0) return;
  for (const factor of [1, 2, 5, 10, 20, 50, 100]) {
    step = snap_m() * factor;
    if (step * camera.scale >= LEAST_PX) break;
  }
  const { x0, y0, x1, y1 } = camera.seen(0);
  context.save();
  context.strokeStyle = colour;
  context.globalAlpha = OPACITY;
  context.lineWidth = 1;
  context.beginPath();
  for (let x = Math.ceil(x0 / step) * step; x <= x1; x += step) {
    const at = Math.round(camera.toScreen(x, 0)[0]) + 0.5;
    context.moveTo(at, 0);
    context.lineTo(at, camera.height);
  }
  for (let y = Math.ceil(y0 / step) * step; y <= y1; y += step) {
    const at = Math.round(camera.toScreen(0, y)[1]) + 0.5;
    context.moveTo(0, at);
    context.lineTo(camera.width, at);
  }
  context.stroke();
  context.restore();
}
