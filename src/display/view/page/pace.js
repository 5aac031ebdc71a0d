// @ts-check

const WINDOW_MS = 1000;

/** Counts the pictures drawn in the last second. */
export class Pace {
  /** @type {number[]} */ #drawn = [];

  /** @param {number} now_ms */
  count(now_ms) {
    this.#drawn.push(now_ms);
    this.#forget(now_ms);
  }

  /** @param {number} now_ms */
  perSecond(now_ms) {
    this.#forget(now_ms);
    return this.#drawn.length;
  }

  /** @param {number} now_ms */
  #forget(now_ms) {
    const first = this.#drawn.findIndex((drawn_ms) => drawn_ms > now_ms - WINDOW_MS);
    this.#drawn.splice(0, first < 0 ? this.#drawn.length : first);
  }
}
