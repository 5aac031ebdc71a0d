// @ts-check
// Contacts that an operator must acknowledge. Each stays until then, also after the show has continued.

/**
 * @typedef {{run_id: number, time_s: number, benches: [number, number] | null, clearance_m: number | null}
 *   & import('./show.js').Named} Contact
 */

/** Greatest number of stored acknowledgements. */
const MOST_KEPT = 200;
/** Greatest number of stored unacknowledged contacts. Further ones are only counted. */
const MOST_WAITING = 50;

export class Contacts {
  /** @type {Set<string>} */ #acknowledged;
  /** @type {Map<string, Contact>} */ #waiting = new Map();
  #left_out = 0;

  /** @param {string} kept the last result of `acknowledge` in this tab; empty for none */
  constructor(kept) {
    this.#acknowledged = new Set(kept === '' ? [] : kept.split('\n'));
  }

  /** Records a contact, unless it is known. @param {Contact} contact */
  take(contact) {
    const key = keyOf(contact);
    if (this.#acknowledged.has(key) || this.#waiting.has(key)) return;
    if (this.#waiting.size >= MOST_WAITING) this.#left_out += 1;
    else this.#waiting.set(key, contact);
  }

  /** The unacknowledged contacts, oldest first, and the number of those that are not stored. */
  waiting() {
    return { contacts: [...this.#waiting.values()], left_out: this.#left_out };
  }

  /** Acknowledges all contacts. Returns the text that the tab must store. */
  acknowledge() {
    for (const key of this.#waiting.keys()) this.#acknowledged.add(key);
    this.#waiting.clear();
    this.#left_out = 0;
    this.#acknowledged = new Set([...this.#acknowledged].slice(-MOST_KEPT));
    return [...this.#acknowledged].join('\n');
  }
}

/**
 * The key of a contact. All overlaps that the view itself measures in a run have one key. The alert's number is not part of the
 * key, since a restarted view gives the same contact another number.
 * @param {Contact} contact
 */
function keyOf({ run_id, time_s, benches }) {
  return benches === null ? `${run_id} overlap` : `${run_id} ${time_s} ${benches.join(' ')}`;
}
