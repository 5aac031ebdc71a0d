// @ts-check
// Contacts that somebody has to take note of: each stays until it is acknowledged, also after the show has gone on.

/** @typedef {{run_id: number, time_s: number, benches: [number, number] | null, clearance_m: number | null}} Contact */

/** Acknowledgements that are remembered at most. */
const MOST_KEPT = 200;
/** Contacts that wait for theirs at most; more are counted. */
const MOST_WAITING = 50;

export class Contacts {
  /** @type {Set<string>} */ #acknowledged;
  /** @type {Map<string, Contact>} */ #waiting = new Map();
  #left_out = 0;

  /** @param {string} kept what `acknowledge` returned in an earlier life of the page; empty for none */
  constructor(kept) {
    this.#acknowledged = new Set(kept === '' ? [] : kept.split('\n'));
  }

  /** Takes note of a contact, unless it is known. @param {Contact} contact */
  take(contact) {
    const key = keyOf(contact);
    if (this.#acknowledged.has(key) || this.#waiting.has(key)) return;
    if (this.#waiting.size >= MOST_WAITING) this.#left_out += 1;
    else this.#waiting.set(key, contact);
  }

  /** The contacts that wait, oldest first, and how many more there are. */
  waiting() {
    return { contacts: [...this.#waiting.values()], left_out: this.#left_out };
  }

  /** Acknowledges all that wait. Returns what has to be kept. */
  acknowledge() {
    for (const key of this.#waiting.keys()) this.#acknowledged.add(key);
    this.#waiting.clear();
    this.#left_out = 0;
    this.#acknowledged = new Set([...this.#acknowledged].slice(-MOST_KEPT));
    return [...this.#acknowledged].join('\n');
  }
}

/** An overlap that the view has measured itself counts once a run. The same contact is reported by a view that was started anew, under another number. @param {Contact} contact */
function keyOf({ run_id, time_s, benches }) {
  return benches === null ? `${run_id} overlap` : `${run_id} ${time_s} ${benches.join(' ')}`;
}
