// @ts-check

/** @typedef {import('./show.js').Chart} Chart */

/** Clearances that have a line. */
const LINES_M = [5, 2, 1, 0.5, 0.2, 0.1, 0.05, 0.02, 0];
/** The range where nothing was outside it. */
const MOST_M = 0.2;
const LEAST_M = -0.004;
/** Deeper overlaps stand out at the bottom: boards do not go through each other, and the clearances need the room. */
const DEEPEST_M = -0.02;

/** Heights of clearances, by their square roots, so that little ones are told apart and big ones have room. */
export class Levels {
  #top_px;
  #bottom_px;

  /**
   * @param {Chart | null} chart what has to fit in
   * @param {readonly import('./plan_times.js').Point[]} planned the same; overlaps of it may stand out at the bottom
   * @param {number} top_px where the largest one is
   * @param {number} bottom_px where the least one is
   */
  constructor(chart, planned, top_px, bottom_px) {
    this.#top_px = top_px;
    this.#bottom_px = bottom_px;
    const seen = chart === null ? [] : [...chart.least_m].filter(Number.isFinite);
    this.most_m = planned.reduce((most_m, point) => Math.max(most_m, point.clearance_m), Math.max(MOST_M, ...seen));
    this.least_m = Math.max(Math.min(LEAST_M, ...seen), DEEPEST_M);
  }

  /** Those that have a line. */
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
