// @ts-check

/** @typedef {import('./show.js').Chart} Chart */

/** Clearances that have a line. */
const LINES_M = [0.2, 0.1, 0.05, 0.02, 0];
/** The range where nothing was outside it. */
const MOST_M = 0.2;
const LEAST_M = -0.004;

/** Heights of clearances, by their square roots, so that little ones are told apart and big ones have room. */
export class Levels {
  #top_px;
  #bottom_px;

  /**
   * @param {Chart | null} chart what has to fit in
   * @param {number} top_px where the largest one is
   * @param {number} bottom_px where the least one is
   */
  constructor(chart, top_px, bottom_px) {
    this.#top_px = top_px;
    this.#bottom_px = bottom_px;
    const seen = chart === null ? [] : [...chart.least_m].filter(Number.isFinite);
    this.most_m = Math.max(MOST_M, ...seen);
    this.least_m = Math.min(LEAST_M, ...seen);
  }

  /** Those that have a line. */
  lines_m() {
    return LINES_M.filter((one) => one <= this.most_m);
  }

  /** @param {number} clearance_m */
  y(clearance_m) {
    const [top, bottom] = [root(this.most_m), root(this.least_m)];
    return this.#top_px + ((top - root(clearance_m)) / (top - bottom)) * (this.#bottom_px - this.#top_px);
  }
}

/** @param {number} value */
function root(value) {
  return Math.sign(value) * Math.sqrt(Math.abs(value));
}
