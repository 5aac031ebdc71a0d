// @ts-check

/** @typedef {import('./boards.js').Board} Board */
/** @typedef {[number, number]} Point */

/**
 * The two nearest points of two boards that are apart, one on each board. One of them is a corner.
 * @param {Board} a
 * @param {Board} b
 * @returns {[Point, Point]}
 */
export function gap(a, b) {
  /** @type {[Point, Point]} */ let found = [
    [a.x, a.y],
    [b.x, b.y],
  ];
  let least_m = Infinity;
  for (const [one, other, isSwapped] of /** @type {[Board, Board, boolean][]} */ ([
    [a, b, false],
    [b, a, true],
  ])) {
    for (const corner of corners(one)) {
      const foot = nearestPoint(other, corner);
      const distance_m = Math.hypot(foot[0] - corner[0], foot[1] - corner[1]);
      if (distance_m < least_m) [least_m, found] = [distance_m, isSwapped ? [foot, corner] : [corner, foot]];
    }
  }
  return found;
}

/** @param {Board} board @returns {Point[]} */
function corners({ x, y, ux, uy, halfLength_m, halfWidth_m }) {
  return [
    [1, 1],
    [1, -1],
    [-1, 1],
    [-1, -1],
  ].map(([along, across]) => [
    x + along * halfLength_m * ux - across * halfWidth_m * uy,
    y + along * halfLength_m * uy + across * halfWidth_m * ux,
  ]);
}

/** @param {Board} board @param {Point} point @returns {Point} */
function nearestPoint({ x, y, ux, uy, halfLength_m, halfWidth_m }, [px, py]) {
  const [dx, dy] = [px - x, py - y];
  const along_m = Math.min(Math.max(dx * ux + dy * uy, -halfLength_m), halfLength_m);
  const across_m = Math.min(Math.max(dy * ux - dx * uy, -halfWidth_m), halfWidth_m);
  return [x + along_m * ux - across_m * uy, y + along_m * uy + across_m * ux];
}
