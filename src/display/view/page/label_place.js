// @ts-check
// The place of the label beside the mark of the nearest pair. It covers neither the mark nor other labels.

/** @typedef {{left: number, top: number, wide: number, high: number}} Rect */

/** Sides of the ring on which the label may stand, the best one first, and its distances from the ring. */
const SIDES = [
  { x: 1, y: -1 },
  { x: -1, y: -1 },
  { x: 1, y: 1 },
  { x: -1, y: 1 },
];
const AWAY_PX = [14, 44, 84];
const EDGE_PX = 4;

/**
 * The first free place, and its side of the ring. Without a free place, it is the first one, and not free.
 * @param {{x: number, y: number, radius: number}} ring
 * @param {{wide: number, high: number}} size
 * @param {{width: number, height: number}} screen
 * @param {readonly Rect[]} taken
 * @returns {{place: Rect, side: {x: number, y: number}, isFree: boolean}}
 */
export function labelPlace({ x, y, radius }, { wide, high }, { width, height }, taken) {
  const inside = (/** @type {number} */ at, /** @type {number} */ most) => Math.min(Math.max(at, EDGE_PX), most - EDGE_PX);
  const places = [];
  for (const away of AWAY_PX) {
    for (const side of SIDES) {
      const edge = radius * Math.SQRT1_2 + away;
      const left = inside(side.x > 0 ? x + edge : x - edge - wide, width - wide);
      const top = inside(y + side.y * edge - high / 2, height - high);
      places.push({ place: { left, top, wide, high }, side });
    }
  }
  const ring = { left: x - radius, top: y - radius, wide: 2 * radius, high: 2 * radius };
  const isFree = (/** @type {Rect} */ place) => [ring, ...taken].every((other) => areApart(place, other));
  const free = places.find(({ place }) => isFree(place));
  return { ...(free ?? places[0]), isFree: free !== undefined };
}

/** @param {Rect} a @param {Rect} b */
function areApart(a, b) {
  return a.left + a.wide <= b.left || b.left + b.wide <= a.left || a.top + a.high <= b.top || b.top + b.high <= a.top;
}
