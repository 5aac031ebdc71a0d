// @ts-check
// The wall clock of the view's machine, which also dates the commands. It goes on while nothing arrives.

const DAY_MS = 86_400_000;
/** A reading that differs by more shows that the machine's clock was set, and by more than half a day, midnight. */
const SET_MS = 60_000;
/** Greatest step back per reading. A reading that was delayed by the network is behind, so the clock hardly follows it. */
const BACK_MS = 1;

export class WallClock {
  /** Time since midnight at the page's time 0. @type {number | null} */ #base_ms = null;

  /** Takes over a reading. @param {number} day_ms time since midnight @param {number} now_ms */
  set(day_ms, now_ms) {
    const base_ms = day_ms - now_ms;
    const ahead_ms = this.#base_ms === null ? Infinity : this.#base_ms - base_ms;
    if (ahead_ms < 0 || ahead_ms > SET_MS) this.#base_ms = base_ms;
    else this.#base_ms = base_ms + Math.max(ahead_ms - BACK_MS, 0);
  }

  /** The time of day, `21:04:37`. @param {number} now_ms */
  text(now_ms) {
    if (this.#base_ms === null) return '–';
    const day_ms = (((this.#base_ms + now_ms) % DAY_MS) + DAY_MS) % DAY_MS;
    const seconds = Math.floor(day_ms / 1e3);
    const part = (/** @type {number} */ value) => String(value).padStart(2, '0');
    return [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, seconds % 60].map(part).join(':');
  }
}
