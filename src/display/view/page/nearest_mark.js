// @ts-check
// The mark of the nearest pair: a ring around the place, a line across the gap, and the clearance.

import { board } from './boards.js';
import { font } from './canvas.js';
import { gap } from './gap.js';
import { labelPlace } from './label_place.js';

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./frame.js').Frame} Frame */
/** @typedef {import('./frame.js').Nearest} Nearest */
/** @typedef {import('./show.js').Run} Run */
/** @typedef {{text: string, ink: string, ground: string, halo: string}} Look */
/** @typedef {import('./label_place.js').Rect} Rect */

const LEAST_RADIUS_PX = 13;
const LARGEST_RADIUS_PX = 60;

/**
 * Draws the mark. Returns the place of its label; `null` if the pair is not on the screen.
 * @param {CanvasRenderingContext2D} context
 * @param {Camera} camera
 * @param {Frame} frame
 * @param {Run | null} run
 * @param {Nearest} nearest
 * @param {Look} look
 * @param {readonly Rect[]} taken places that the label leaves free
 */
export function drawNearestMark(context, camera, frame, run, { clearance_m, benches, point_m }, look, taken) {
  const [x, y] = camera.toScreen(...point_m);
  if (x < -20 || y < -20 || x > camera.width + 20 || y > camera.height + 20) return null;
  const radius = Math.min(Math.max(LEAST_RADIUS_PX, clearance_m * camera.scale * 0.75 + 6), LARGEST_RADIUS_PX);
  context.lineWidth = 5;
  context.strokeStyle = look.halo;
  ring(context, x, y, radius);
  context.lineWidth = 2.25;
  context.strokeStyle = look.ink;
  ring(context, x, y, radius);
  if (clearance_m > 0) {
    const [a, b] = benches.map((bench) => board(frame, run, bench));
    const [from, to] = gap(a, b).map((point) => camera.toScreen(...point));
    context.beginPath();
    context.moveTo(...from);
    context.lineTo(...to);
    context.stroke();
  }
  return drawLabel(context, camera, { x, y, radius }, look, taken);
}

/**
 * Draws the label beside the ring, in the first free place: above at the right or left, below, or further away.
 * @param {CanvasRenderingContext2D} context
 * @param {Camera} camera
 * @param {{x: number, y: number, radius: number}} ring
 * @param {Look} look
 * @param {readonly Rect[]} taken
 */
function drawLabel(context, camera, { x, y, radius }, { text, ink, ground }, taken) {
  context.font = font(650, 16);
  const size = { wide: context.measureText(text).width + 18, high: 28 };
  const { place, side } = labelPlace({ x, y, radius }, size, camera, taken);
  const { left, top, wide, high } = place;
  context.beginPath();
  context.moveTo(x + side.x * radius * Math.SQRT1_2, y + side.y * radius * Math.SQRT1_2);
  context.lineTo(side.x > 0 ? left : left + wide, top + high / 2);
  context.stroke();
  context.beginPath();
  context.roundRect(left, top, wide, high, 7);
  context.fillStyle = ground;
  context.fill();
  context.lineWidth = 1.75;
  context.stroke();
  context.fillStyle = ink;
  context.textBaseline = 'middle';
  context.textAlign = 'left';
  context.fillText(text, left + 9, top + high / 2 + 1);
  return place;
}

/** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {number} radius */
function ring(context, x, y, radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.stroke();
}
