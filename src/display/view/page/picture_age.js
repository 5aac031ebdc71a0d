// @ts-check
// The age of the picture, although the clocks of the page and of the view differ. The page acknowledges each frame, and the view
// reports when an acknowledgement arrived. It arrived after it was sent, so the view's clock was at most that far ahead. The
// bound is as good as the fastest acknowledgement of the last minute. So a slow network makes the age too large, never too small.

/** The clocks drift apart, so older measurements lapse. */
const WINDOW_MS = 60_000;
const PARTS = 6;
const MOST_UNANSWERED = 64;

export class PictureAge {
  /** When the page sent each acknowledgement, by sequence number. @type {Map<number, number>} */ #sent = new Map();
  /** Least measured lead of the view's clock in each part of the window. @type {{until_ms: number, lead_ms: number}[]} */ #leads = [];

  /** Forgets everything, since another view has another clock. */
  restart() {
    this.#sent.clear();
    this.#leads = [];
  }

  /** @param {number} sequence @param {number} now_ms */
  sent(sequence, now_ms) {
    this.#sent.set(sequence, now_ms);
    for (const oldest of this.#sent.keys()) {
      if (this.#sent.size <= MOST_UNANSWERED) break;
      this.#sent.delete(oldest);
    }
  }

  /**
   * Takes over when the view received an acknowledgement.
   * @param {{sequence: number, at_ms: number} | null} heard
   * @param {number} now_ms
   */
  heard(heard, now_ms) {
    const sent_ms = heard === null ? undefined : this.#sent.get(heard.sequence);
    if (heard === null || sent_ms === undefined) return;
    this.#sent.delete(heard.sequence);
    const lead_ms = heard.at_ms - sent_ms;
    const last = this.#leads.at(-1);
    if (last === undefined || now_ms > last.until_ms) {
      this.#leads.push({ until_ms: now_ms + WINDOW_MS / PARTS, lead_ms });
      if (this.#leads.length > PARTS) this.#leads.shift();
    } else {
      last.lead_ms = Math.min(last.lead_ms, lead_ms);
    }
  }

  /**
   * The greatest possible age in seconds of a picture from an instant of the view's clock; `null` before the first measurement.
   * @param {number} due_ms
   * @param {number} now_ms
   */
  of(due_ms, now_ms) {
    if (this.#leads.length === 0) return null;
    return Math.max(now_ms + Math.min(...this.#leads.map(({ lead_ms }) => lead_ms)) - due_ms, 0) / 1e3;
  }
}
