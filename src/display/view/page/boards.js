// @ts-check
// The boards of a frame, seen from above: bench i of a dragon lies between its handles i and i + 1, and extends beyond both.
// Benches and handles are numbered on from dragon to dragon.

import { dragonOf } from './frame.js';

/** @typedef {import('./frame.js').Frame} Frame */
/** @typedef {import('./show.js').Run} Run */
/**
 * @typedef {object} Board a rectangle
 * @property {number} x of its centre
 * @property {number} y
 * @property {number} ux unit vector from its rear to its front
 * @property {number} uy
 * @property {number} halfLength_m
 * @property {number} halfWidth_m
 * @property {number | null} z of its centre; `null` on level ground
 */

/** Dimensions that are used while the dragon's are unknown: the boards are then as long as the links. */
const UNKNOWN = { hole_offset_m: 0, width_m: 0.1 };

/**
 * @param {Frame} frame
 * @param {Run | null} run
 * @param {number} bench
 * @returns {Board}
 */
export function board(frame, run, bench) {
  const number = dragonOf(frame, bench);
  const front = bench + number;
  const at = front * 3;
  const { handles, heights } = frame;
  const [frontX, frontY, rearX, rearY] = [handles[at], handles[at + 1], handles[at + 3], handles[at + 4]];
  const [dx, dy] = [frontX - rearX, frontY - rearY];
  const link_m = Math.hypot(dx, dy) || 1;
  const { hole_offset_m, width_m } = run?.dragons?.[number] ?? run ?? UNKNOWN;
  // A pitched board is seen shorter.
  const rise_m = heights === null ? 0 : heights[front] - heights[front + 1];
  const seen = link_m / Math.hypot(link_m, rise_m);
  return {
    x: (frontX + rearX) / 2,
    y: (frontY + rearY) / 2,
    ux: dx / link_m,
    uy: dy / link_m,
    halfLength_m: link_m / 2 + hole_offset_m * seen,
    halfWidth_m: width_m / 2,
    z: heights === null ? null : (heights[front] + heights[front + 1]) / 2,
  };
}

/**
 * Adds a board's outline to a path, in metres.
 * @param {Path2D} path
 * @param {Board} board
 */
export function addOutline(path, { x, y, ux, uy, halfLength_m, halfWidth_m }) {
  const [ax, ay, bx, by] = [ux * halfLength_m, uy * halfLength_m, -uy * halfWidth_m, ux * halfWidth_m];
  path.moveTo(x + ax + bx, y + ay + by);
  path.lineTo(x - ax + bx, y - ay + by);
  path.lineTo(x - ax - bx, y - ay - by);
  path.lineTo(x + ax - bx, y + ay - by);
  path.closePath();
}

/**
 * The bench at a point, or the nearest bench within `reach_m`; `null` if there is none.
 * @param {Frame} frame
 * @param {Run | null} run
 * @param {[number, number]} point_m
 * @param {number} reach_m
 * @returns {number | null}
 */
export function benchAt(frame, run, [px, py], reach_m) {
  let [found, least_m] = [/** @type {number | null} */ (null), reach_m];
  for (let bench = 0; bench < frame.benches; bench += 1) {
    const { x, y, ux, uy, halfLength_m, halfWidth_m } = board(frame, run, bench);
    const [dx, dy] = [px - x, py - y];
    const along_m = Math.max(Math.abs(dx * ux + dy * uy) - halfLength_m, 0);
    const across_m = Math.max(Math.abs(dy * ux - dx * uy) - halfWidth_m, 0);
    const distance_m = Math.hypot(along_m, across_m);
    if (distance_m < least_m || (distance_m === 0 && found === null)) [found, least_m] = [bench, distance_m];
  }
  return found;
}

/** @param {Frame} frame @param {Run | null} run */
export function longestBoard(frame, run) {
  // All benches of a dragon but the first are equally long.
  const kinds = frame.dragons.flatMap(({ first_bench, benches }) => (benches > 1 ? [first_bench, first_bench + 1] : [first_bench]));
  return 2 * Math.max(...kinds.map((bench) => board(frame, run, bench).halfLength_m));
}
