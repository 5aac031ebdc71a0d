// @ts-check
// The text, with undo and redo without end, and its draft in the browser, which survives a closed tab and a killed program.

import { TabDrafts } from './tab_drafts.js';

/** Pause after which typing is an edit of its own, for undo. */
const PAUSE_MS = 800;

export class Draft {
  text = '';
  /** @type {string | null} */ name = null;
  /** What the page knows of the file on the disk. @type {{text: string, mark: string | null}} */ saved = { text: '', mark: null };
  /** @type {string[]} */ #past = [];
  /** @type {string[]} */ #future = [];
  #typed_ms = -Infinity;
  /** @type {TabDrafts | null} */ #drafts = null;

  /**
   * Begins with a file, or with the draft of it. Returns whether there was a draft.
   * @param {{name: string | null, text: string, mark: string | null}} file
   */
  async begin({ name, text, mark }) {
    Object.assign(this, { name, text, saved: { text, mark } });
    this.#drafts = new TabDrafts(name ?? '');
    const kept = await this.#drafts.open();
    if (kept === null || kept.text === text) return false;
    this.text = kept.text;
    // With another mark than that of the disk, saving is refused: another program has changed the file.
    this.saved = { text, mark: kept.mark };
    this.#keep();
    return true;
  }

  get isChanged() {
    return this.text !== this.saved.text;
  }

  get canUndo() {
    return this.#past.length > 0;
  }

  get canRedo() {
    return this.#future.length > 0;
  }

  /** Takes a new text, as one edit. @param {string} text */
  commit(text) {
    if (text === this.text) return;
    this.#past.push(this.text);
    this.#future = [];
    this.#typed_ms = -Infinity;
    this.#set(text);
  }

  /** Takes a text that is being typed: what is typed without a pause is one edit. @param {string} text @param {number} now_ms */
  type(text, now_ms) {
    if (text === this.text) return;
    if (now_ms - this.#typed_ms > PAUSE_MS) this.#past.push(this.text);
    this.#future = [];
    this.#typed_ms = now_ms;
    this.#set(text);
  }

  /** Returns whether there was an edit to undo. */
  undo() {
    return this.#step(this.#past, this.#future);
  }

  redo() {
    return this.#step(this.#future, this.#past);
  }

  /** @param {string} name @param {string} text @param {string} mark */
  wasSaved(name, text, mark) {
    this.#drafts?.keep(null);
    this.#drafts?.turnTo(name);
    this.name = name;
    this.saved = { text, mark };
    this.#keep();
  }

  /** Takes the file on the disk as the one that this text will replace. @param {{text: string, mark: string | null}} file */
  replace({ text, mark }) {
    this.saved = { text, mark };
    this.#keep();
  }

  /** Goes back to the file, as one edit. @param {{text: string, mark: string | null}} file */
  reload({ text, mark }) {
    this.saved = { text, mark };
    this.commit(text);
    this.#keep();
  }

  /** @param {string[]} from @param {string[]} to */
  #step(from, to) {
    const text = from.pop();
    if (text === undefined) return false;
    to.push(this.text);
    this.#typed_ms = -Infinity;
    this.#set(text);
    return true;
  }

  /** @param {string} text */
  #set(text) {
    this.text = text;
    this.#keep();
  }

  #keep() {
    this.#drafts?.keep(this.isChanged ? { text: this.text, mark: this.saved.mark } : null);
  }
}
