// @ts-check
// The boards that overlap. They are searched for only if the frame's nearest pair overlaps, since other pairs may overlap too.

import { board, longestBoard } from './boards.js';
import { dragonOf } from './frame.js';

/** @typedef {import('./boards.js').Board} Board */

/**
 * The benches that overlap a bench other than a neighbour.
 * @param {import('./frame.js').Frame} frame
 * @param {import('./show.js').Run | null} run
 * @returns {Set<number>}
 */
export function overlapping(frame, run) {
  /** @type {Set<number>} */ const found = new Set();
  /** @type {Map<string, number[]>} */ const cells = new Map();
  const boards = Array.from({ length: frame.benches }, (_, bench) => board(frame, run, bench));
  // The centres of two overlapping boards are nearer than the length of the longest board. So they lie in the same cell or in
  // adjacent ones.
  const cell_m = longestBoard(frame, run);
  boards.forEach((one, bench) => {
    const [column, row] = [Math.floor(one.x / cell_m), Math.floor(one.y / cell_m)];
    for (let dx = -1; dx <= 1; dx += 1) {
      for (let dy = -1; dy <= 1; dy += 1) {
        for (const other of cells.get(`${column + dx} ${row + dy}`) ?? []) {
          // Benches of two dragons are no neighbours, whatever their numbers.
          const isPair = bench - other > 1 || dragonOf(frame, bench) !== dragonOf(frame, other);
          if (isPair && overlap(one, boards[other])) found.add(bench).add(other);
        }
      }
    }
    const key = `${column} ${row}`;
    const cell = cells.get(key);
    if (cell === undefined) cells.set(key, [bench]);
    else cell.push(bench);
  });
  return found;
}

/**
 * Whether two boards overlap: two rectangles are apart if and only if their projections on some side of one of them are apart.
 * @param {Board} a
 * @param {Board} b
 */
function overlap(a, b) {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const [cos, sin] = [Math.abs(a.ux * b.ux + a.uy * b.uy), Math.abs(a.ux * b.uy - a.uy * b.ux)];
  return (
    Math.abs(dx * a.ux + dy * a.uy) < a.halfLength_m + b.halfLength_m * cos + b.halfWidth_m * sin &&
    Math.abs(dy * a.ux - dx * a.uy) < a.halfWidth_m + b.halfLength_m * sin + b.halfWidth_m * cos &&
    Math.abs(dx * b.ux + dy * b.uy) < b.halfLength_m + a.halfLength_m * cos + a.halfWidth_m * sin &&
    Math.abs(dy * b.ux - dx * b.uy) < b.halfWidth_m + a.halfLength_m * sin + a.halfWidth_m * cos
  );
}
