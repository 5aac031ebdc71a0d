// @ts-check
// The drafts of all tabs in this browser, each under a key of its own, so that no tab overwrites another one's. A tab that opens takes
// over the newest draft whose tab is gone: it asks the others who is there.

import { ofTab } from './storage.js';

/** @typedef {{text: string, mark: string | null, at_ms: number}} Kept */

/** Time in which other tabs answer. */
const ANSWER_MS = 250;

const own = ofTab('bench-dragon.plan-tab');

export class TabDrafts {
  #prefix = '';
  #tab = '';
  #channel = new BroadcastChannel('bench-dragon.plan');

  /** @param {string} name of the file */
  constructor(name) {
    this.#prefix = `bench-dragon.plan.${name}.`;
    this.#channel.addEventListener('message', ({ data }) => {
      if (data === 'who' && this.#tab !== '') this.#channel.postMessage(this.#tab);
    });
  }

  /** The tab's own draft, or the newest one that a closed tab has left. @returns {Promise<Kept | null>} */
  async open() {
    const there = await this.#others();
    const before = own.read();
    // A duplicated tab has the name of the other one.
    this.#tab = before !== null && !there.has(before) ? before : crypto.getRandomValues(new Uint32Array(2)).join('-');
    own.write(this.#tab);
    const mine = parsed(read(this.#prefix + this.#tab));
    if (mine !== null) return mine;
    const left = keys().filter((key) => key.startsWith(this.#prefix) && !there.has(key.slice(this.#prefix.length)));
    const all = left.map((key) => ({ key, kept: parsed(read(key)) }));
    const newest = all.toSorted((one, other) => (other.kept?.at_ms ?? 0) - (one.kept?.at_ms ?? 0))[0];
    if (newest === undefined || newest.kept === null) return null;
    write(newest.key, null);
    return newest.kept;
  }

  /** The names of the tabs that are open. @returns {Promise<Set<string>>} */
  #others() {
    return new Promise((resolve) => {
      /** @type {Set<string>} */ const found = new Set();
      const hear = (/** @type {MessageEvent} */ { data }) => data !== 'who' && found.add(data);
      this.#channel.addEventListener('message', hear);
      this.#channel.postMessage('who');
      setTimeout(() => {
        this.#channel.removeEventListener('message', hear);
        resolve(found);
      }, ANSWER_MS);
    });
  }

  /** From now on, the drafts are those of another file. @param {string} name */
  turnTo(name) {
    this.#prefix = `bench-dragon.plan.${name}.`;
  }

  /** Keeps a draft; `null` removes it. @param {{text: string, mark: string | null} | null} draft */
  keep(draft) {
    write(this.#prefix + this.#tab, draft === null ? null : JSON.stringify({ ...draft, at_ms: Date.now() }));
  }
}

function keys() {
  try {
    return Object.keys(localStorage);
  } catch {
    // The user has blocked site data: a draft lasts until the page is closed.
    return [];
  }
}

/** @param {string} key */
function read(key) {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}

/** @param {string} key @param {string | null} value */
function write(key, value) {
  try {
    if (value === null) localStorage.removeItem(key);
    else localStorage.setItem(key, value);
  } catch {
    // As above, or the browser has no room.
  }
}

/** @param {string | null} kept @returns {Kept | null} */
function parsed(kept) {
  try {
    const value = JSON.parse(kept ?? '');
    return typeof value?.text === 'string' ? value : null;
  } catch {
    return null;
  }
}
