// @ts-check
// The names of several dragons beside their heads, each with a bar in the dragon's colour.

import { font } from './canvas.js';
import { labelPlace } from './label_place.js';

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./frame.js').Frame} Frame */
/** @typedef {import('./label_place.js').Rect} Rect */
/** @typedef {import('./show.js').Run} Run */

const HIGH_PX = 22;
const BAR_PX = 6;
const PAD_PX = 5;
/** Radius around a head that its name leaves free. */
const HEAD_PX = 12;

/**
 * Draws the names of the heads on the screen. Returns their places. With one dragon, it draws none.
 * @param {CanvasRenderingContext2D} context
 * @param {Camera} camera
 * @param {Frame} frame
 * @param {Run | null} run
 * @param {{ink: string, ground: string}} look
 * @param {readonly Rect[]} taken places that the names leave free
 * @returns {Rect[]}
 */
export function drawNames(context, camera, frame, run, { ink, ground }, taken) {
  const named = run?.dragons ?? [];
  /** @type {Rect[]} */ const drawn = [];
  context.font = font(650, 14);
  context.textBaseline = 'middle';
  context.textAlign = 'left';
  named.forEach(({ name, colour, first_handle }) => {
    const at = first_handle * 3;
    const [x, y] = camera.toScreen(frame.handles[at], frame.handles[at + 1]);
    if (!(x >= 0 && y >= 0 && x <= camera.width && y <= camera.height)) return;
    const size = { wide: context.measureText(name).width + BAR_PX + 2 * PAD_PX, high: HIGH_PX };
    const { place, isFree } = labelPlace({ x, y, radius: HEAD_PX }, size, camera, [...taken, ...drawn]);
    // Names that cover each other cannot be read. A nearer look has room for them.
    if (!isFree) return;
    const { left, top, wide, high } = place;
    context.fillStyle = ground;
    context.fillRect(left, top, wide, high);
    context.fillStyle = colour;
    context.fillRect(left, top, BAR_PX, high);
    context.strokeStyle = ink;
    context.lineWidth = 1;
    context.strokeRect(left + 0.5, top + 0.5, wide - 1, high - 1);
    context.fillStyle = ink;
    context.fillText(name, left + BAR_PX + PAD_PX, top + high / 2 + 1);
    drawn.push(place);
  });
  return drawn;
}
