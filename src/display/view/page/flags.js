// @ts-check
// The placement of flags: in rows above the picture, each beside its line, without overlaps.

/**
 * @typedef {object} Flag
 * @property {number} x position of its line
 * @property {number} wide
 * @property {boolean} [isNeeded] whether it is shown even at a distance from its line
 */
/** @typedef {{left: number, row: number}} Place */

const GAP_PX = 4;
const EDGE_PX = 2;

/**
 * A place for each flag, in their order: right of its line, left of it, or around it, in the first row that has room. A flag
 * without room has no place. A needed flag without room gets the nearest free place.
 * @param {readonly Flag[]} flags the most important first
 * @param {number} width width of the picture
 * @param {number} rows
 * @returns {(Place | null)[]}
 */
export function placeFlags(flags, width, rows) {
  /** @type {(Place & {wide: number})[]} */
  const taken = [];
  return flags.map(({ x, wide, isNeeded = false }) => {
    const isFree = (/** @type {Place} */ { left, row }) =>
      left >= EDGE_PX &&
      left + wide <= width - EDGE_PX &&
      taken.every((one) => one.row !== row || left >= one.left + one.wide + GAP_PX || left + wide + GAP_PX <= one.left);
    const beside = [x - 1, x - wide + 1, x - wide / 2];
    const wished = Array.from({ length: rows }, (_, row) => beside.map((left) => ({ left, row }))).flat();
    const place = wished.find(isFree) ?? (isNeeded ? anywhere(x, wide, width, rows, isFree) : null);
    if (place !== null) taken.push({ ...place, wide });
    return place;
  });
}

/**
 * The free place nearest to a line; `null` if there is none.
 * @param {number} x
 * @param {number} wide
 * @param {number} width
 * @param {number} rows
 * @param {(place: Place) => boolean} isFree
 * @returns {Place | null}
 */
function anywhere(x, wide, width, rows, isFree) {
  for (let away = 0; away < width; away += 1) {
    for (let row = 0; row < rows; row += 1) {
      const found = [x - wide / 2 - away, x - wide / 2 + away].map((left) => ({ left, row })).find(isFree);
      if (found !== undefined) return found;
    }
  }
  return null;
}
