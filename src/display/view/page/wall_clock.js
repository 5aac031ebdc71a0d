// @ts-check
// The wall clock of the view's machine, which also dates the commands. It goes on while nothing arrives.

const DAY_MS = 86_400_000;

export class WallClock {
  /** @type {{day_ms: number, at_ms: number} | null} */ #read = null;

  /** @param {number} day_ms time since midnight @param {number} now_ms */
  set(day_ms, now_ms) {
    this.#read = { day_ms, at_ms: now_ms };
  }

  /** The time of day, `21:04:37`. @param {number} now_ms */
  text(now_ms) {
    if (this.#read === null) return '–';
    const seconds = Math.floor(((this.#read.day_ms + now_ms - this.#read.at_ms) % DAY_MS) / 1e3);
    const part = (/** @type {number} */ value) => String(value).padStart(2, '0');
    return [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, seconds % 60].map(part).join(':');
  }
}
