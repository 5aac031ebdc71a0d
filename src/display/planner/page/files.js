// @ts-check
// Saving: under the file's name, or under another name in the same folder. Nothing of another program is overwritten.

import { element, write } from './element.js';
import { ofTab } from './storage.js';

/** @typedef {import('./draft.js').Draft} Draft */
/** @typedef {import('./desk.js').Desk} Desk */

const saved = element('saved', HTMLSpanElement);
const notice = element('notice', HTMLElement);
const noticeButtons = element('notice-buttons', HTMLDivElement);
const dialog = element('name-dialog', HTMLDialogElement);
const nameField = element('name', HTMLInputElement);
/** The file that the program was started with, and the one that this tab has saved since, as JSON. */
const savedAs = ofTab('bench-dragon.plan-file');

/** @param {string} text @param {'quiet' | 'changed' | 'bad'} tone */
function showSaved(text, tone) {
  write(saved, text);
  saved.dataset.tone = tone;
}

/** Shows a notice, perhaps with choices. @param {string | null} text @param {Record<string, () => void>} [choices] */
export function note(text, choices = {}) {
  notice.hidden = text === null;
  write(element('notice-text', HTMLElement), text ?? '');
  noticeButtons.replaceChildren(...Object.entries(choices).map(([word, act]) => {
    const button = document.createElement('button');
    button.type = 'button';
    button.textContent = word;
    button.addEventListener('click', () => {
      notice.hidden = true;
      act();
    });
    return button;
  }));
}

/** Takes away a notice that asks for nothing. */
export function endNote() {
  if (noticeButtons.childElementCount === 0) note(null);
}

export class Files {
  #draft;
  #desk;
  #refused = '';
  #changed;
  /** @type {string | null} */ #started = null;
  maySave = false;
  /** Takes a text from the disk. @type {(file: {text: string, mark: string | null}) => void} */ reload = () => {};

  /** @param {Draft} draft @param {Desk} desk @param {() => void} changed */
  constructor(draft, desk, changed) {
    this.#draft = draft;
    this.#desk = desk;
    this.#changed = changed;
    element('save', HTMLButtonElement).addEventListener('click', () => void this.save().then(changed));
    element('save-as', HTMLButtonElement).addEventListener('click', () => this.#askName());
    element('name-cancel', HTMLButtonElement).addEventListener('click', () => dialog.close());
    element('name-form', HTMLFormElement).addEventListener('submit', () => void this.#write(nameField.value, null).then(changed));
  }

  /** The file of this tab: the one that it has saved under another name, or the one that the program was started with. */
  async open() {
    const file = await this.#desk.file(null);
    this.#started = file.name;
    const [started, name] = JSON.parse(savedAs.read() ?? '[]');
    if (name === undefined || started !== file.name || name === file.name) return file;
    const saved = await this.#desk.file(name);
    return saved.error === undefined ? saved : file;
  }

  /** Saves under the file's name, or asks for a name. */
  async save() {
    if (!this.maySave) return;
    if (this.#draft.name === null) this.#askName();
    else if (this.#draft.isChanged) await this.#write(this.#draft.name, this.#draft.saved.mark);
  }

  #askName() {
    nameField.value = '';
    dialog.showModal();
  }

  /** @param {string} name @param {string | null} known */
  async #write(name, known) {
    const { text } = this.#draft;
    showSaved('saving …', 'quiet');
    const { mark, error, isConflict } = await this.#desk.save({ name, text, known });
    this.#refused = error ?? '';
    if (mark !== undefined) {
      this.#draft.wasSaved(name, text, mark);
      savedAs.write(JSON.stringify([this.#started, name]));
      note(null);
    } else if (isConflict && name === this.#draft.name) await this.#offerChoice(name);
  }

  /** The file on the disk is another one, or gone: nothing is lost without a choice. @param {string} name */
  async #offerChoice(name) {
    const file = await this.#desk.file(name);
    const saveAs = { 'Save as …': () => this.#askName() };
    if (file.error !== undefined) {
      note(`${name} is no longer there, or cannot be read.`, { ...saveAs, 'Write it again': () => void this.#write(name, null).then(this.#changed) });
      return;
    }
    note(`${name} on the disk is newer than what this page began with. Another tab or program has saved it.`, {
      ...saveAs,
      'Take the newer file': () => this.reload(file),
      'Overwrite it': () => void this.#overwrite(file),
    });
  }

  /** @param {{text: string, mark: string | null}} file */
  async #overwrite(file) {
    this.#draft.replace(file);
    await this.save();
    this.#changed();
  }

  /** A text that has changed since may be saved again. */
  forget() {
    this.#refused = '';
  }

  /** @param {boolean} isValid whether the text has no mistake */
  show(isValid) {
    const { name, isChanged, canUndo, canRedo } = this.#draft;
    write(element('file', HTMLElement), name ?? 'the paper’s dragon');
    element('save', HTMLButtonElement).disabled = !this.maySave || !isValid || !(isChanged || name === null);
    element('save-as', HTMLButtonElement).disabled = !this.maySave || !isValid;
    element('undo', HTMLButtonElement).disabled = !canUndo;
    element('redo', HTMLButtonElement).disabled = !canRedo;
    if (this.#refused !== '') showSaved(this.#refused, 'bad');
    else if (!this.maySave) showSaved('to save, open the printed address with its token', 'quiet');
    else if (isChanged) showSaved('changed, not saved', 'changed');
    else showSaved(name === null ? '' : 'saved', 'quiet');
    document.title = `${isChanged ? '• ' : ''}${name ?? 'Plan'} · bench-dragon`;
  }
}
