// @ts-check
// Saving: under the file's name, or under another name in the same folder. Nothing of another program is overwritten.

import { element, write } from './element.js';

/** @typedef {import('./draft.js').Draft} Draft */
/** @typedef {import('./desk.js').Desk} Desk */

const saved = element('saved', HTMLSpanElement);
const notice = element('notice', HTMLElement);
const noticeButton = element('notice-button', HTMLButtonElement);
const dialog = element('name-dialog', HTMLDialogElement);
const nameField = element('name', HTMLInputElement);

/** @param {string} text @param {'quiet' | 'changed' | 'bad'} tone */
function tell(text, tone) {
  write(saved, text);
  saved.dataset.tone = tone;
}

/** Shows a notice, perhaps with a button. @param {string | null} text @param {string} [word] @param {() => void} [act] */
export function note(text, word, act) {
  notice.hidden = text === null;
  write(element('notice-text', HTMLElement), text ?? '');
  noticeButton.hidden = word === undefined;
  noticeButton.textContent = word ?? '';
  noticeButton.onclick = () => {
    notice.hidden = true;
    act?.();
  };
}

export class Files {
  #draft;
  #desk;
  #refused = '';
  maySave = false;

  /** @param {Draft} draft @param {Desk} desk @param {() => void} changed */
  constructor(draft, desk, changed) {
    this.#draft = draft;
    this.#desk = desk;
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
    const { mark, error } = await this.#desk.save({ name, text, known });
    this.#refused = error ?? '';
    if (mark !== undefined) this.#draft.wasSaved(name, text, mark);
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
