// @ts-check
// Saving: under the file's name, or under another name in the same folder. Nothing of another program is overwritten.

import { element, write } from './element.js';

/** @typedef {import('./draft.js').Draft} Draft */
/** @typedef {import('./desk.js').Desk} Desk */

const saved = element('saved', HTMLSpanElement);
const notice = element('notice', HTMLElement);
const noticeButtons = element('notice-buttons', HTMLDivElement);
const dialog = element('name-dialog', HTMLDialogElement);
const nameField = element('name', HTMLInputElement);

/** @param {string} text @param {'quiet' | 'changed' | 'bad'} tone */
function tell(text, tone) {
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

export class Files {
  #draft;
  #desk;
  #refused = '';
  #changed;
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
    tell('saving …', 'quiet');
    const { mark, error, isConflict } = await this.#desk.save({ name, text, known });
    this.#refused = error ?? '';
    if (mark !== undefined) {
      this.#draft.wasSaved(name, text, mark);
      note(null);
    } else if (isConflict && name === this.#draft.name) this.#offerChoice(name);
  }

  /** The file on the disk is another one: nothing is lost without a choice. @param {string} name */
  #offerChoice(name) {
    note(`${name} on the disk is newer than what this page began with. Another tab or program has saved it.`, {
      'Save as …': () => this.#askName(),
      'Take the newer file': () => void this.#desk.file().then((file) => file.error === undefined && this.reload(file)),
      'Overwrite it': () => void this.#overwrite(),
    });
  }

  async #overwrite() {
    const file = await this.#desk.file();
    if (file.error !== undefined) return;
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
    if (this.#refused !== '') tell(this.#refused, 'bad');
    else if (!this.maySave) tell('to save, open the printed address with its token', 'quiet');
    else if (isChanged) tell('changed, not saved', 'changed');
    else tell(name === null ? '' : 'saved', 'quiet');
    document.title = `${isChanged ? '• ' : ''}${name ?? 'Plan'} · bench-dragon`;
  }
}
