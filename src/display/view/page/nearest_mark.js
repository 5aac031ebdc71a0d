// @ts-check
// The mark of the nearest pair: a ring around the place, a line across the gap, and the clearance.

import { board } from './boards.js';
import { font } from './canvas.js';
import { gap } from './gap.js';

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./frame.js').Frame} Frame */
/** @typedef {import('./frame.js').Nearest} Nearest */
/** @typedef {import('./show.js').Run} Run */
/** @typedef {{text: string, ink: string, ground: string, halo: string}} Look */

/** Width of the buttons at the right of the plan. */
const LENSES_PX = 72;
const LEAST_RADIUS_PX = 13;
const LARGEST_RADIUS_PX = 60;

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Camera} camera
 * @param {Frame} frame
 * @param {Run | null} run
 * @param {Nearest} nearest
 * @param {Look} look
 */
export function drawNearestMark(context, camera, frame, run, { clearance_m, benches, point_m }, look) {
  const [x, y] = camera.toScreen(...point_m);
  if (x < -20 || y < -20 || x > camera.width + 20 || y > camera.height + 20) return;
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
  drawLabel(context, camera, { x, y, radius }, look);
}

/**
 * Draws the label above and to the right of the ring, or to the left at the plan's right end.
 * @param {CanvasRenderingContext2D} context
 * @param {Camera} camera
 * @param {{x: number, y: number, radius: number}} ring
 * @param {Look} look
 */
function drawLabel(context, camera, { x, y, radius }, { text, ink, ground }) {
  context.font = font(650, 15);
  const [wide, high] = [context.measureText(text).width + 18, 27];
  const isRight = x + radius + 22 + wide < camera.width - LENSES_PX;
  const [fromX, fromY] = [x + (isRight ? 1 : -1) * radius * Math.SQRT1_2, y - radius * Math.SQRT1_2];
  const [atX, atY] = [fromX + (isRight ? 14 : -14 - wide), Math.max(fromY - 14 - high / 2, 4)];
  context.beginPath();
  context.moveTo(fromX, fromY);
  context.lineTo(isRight ? atX : atX + wide, atY + high / 2);
  context.stroke();
  context.beginPath();
  context.roundRect(atX, atY, wide, high, 7);
  context.fillStyle = ground;
  context.fill();
  context.lineWidth = 1.75;
  context.stroke();
  context.fillStyle = ink;
  context.textBaseline = 'middle';
  context.textAlign = 'left';
  context.fillText(text, atX + 9, atY + high / 2 + 1);
}

/** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {number} radius */
function ring(context, x, y, radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.stroke();
}
