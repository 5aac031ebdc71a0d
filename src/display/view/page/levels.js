// @ts-check

/** @typedef {import('./show.js').Chart} Chart */

/** Clearances that have a line, in metres. */
const LINES_M = [5, 2, 1, 0.5, 0.2, 0.1, 0.05, 0.02, 0];
/** The smallest range of the axis. */
const MOST_M = 0.2;
const LEAST_M = -0.004;
/** Lowest end of the axis. Deeper overlaps are drawn there: real boards cannot overlap, and clearances need the room. */
const DEEPEST_M = -0.02;

/** Heights of clearances on a square-root scale, which separates small values and leaves room for large ones. */
export class Levels {
  #top_px;
  #bottom_px;

  /**
   * @param {Chart | null} chart the measured clearances, which must fit
   * @param {readonly import('./plan_times.js').Point[]} planned the planned clearances, which must fit except overlaps
   * @param {number} top_px height of the largest clearance
   * @param {number} bottom_px height of the least clearance
   */
  constructor(chart, planned, top_px, bottom_px) {
    this.#top_px = top_px;
    this.#bottom_px = bottom_px;
    const seen = chart === null ? [] : [...chart.least_m].filter(Number.isFinite);
    this.most_m = planned.reduce((most_m, point) => Math.max(most_m, point.clearance_m), Math.max(MOST_M, ...seen));
    this.least_m = Math.max(Math.min(LEAST_M, ...seen), DEEPEST_M);
  }

  /** The clearances in range that have a line. */
  lines_m() {
    return LINES_M.filter((one) => one <= this.most_m);
  }

  /** @param {number} clearance_m */
  y(clearance_m) {
    const [top, bottom] = [root(this.most_m), root(this.least_m)];
    const part = (top - root(clearance_m)) / (top - bottom);
    return this.#top_px + Math.min(part, 1) * (this.#bottom_px - this.#top_px);
  }
}

/** @param {number} value */
function root(value) {
  return Math.sign(value) * Math.sqrt(Math.abs(value));
}
