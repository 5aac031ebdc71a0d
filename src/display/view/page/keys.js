// @ts-check
// Keyboard shortcuts and their list. A switch in the list turns them off, for users who dictate to the browser or have a
// tremor, and press letters unintentionally. Keys with Ctrl, Alt or Meta are left to the browser.

import { element } from './element.js';
import { ofBrowser } from './storage.js';

/**
 * The action of each key, by its name. Letters are in upper case, after `Shift+` with Shift.
 * @typedef {Record<string, () => void>} Keys
 */

const kept = ofBrowser('bench-dragon.keys');
const shortcuts = element('shortcuts', HTMLDialogElement);
const areOn = element('keys-are-on', HTMLInputElement);
const plan = element('plan-area', HTMLElement);

/**
 * @param {() => void} hold action of H: wherever the focus is, with or without Shift, and while the list is open
 * @param {Keys} keys the other actions, used unless the focused element needs the key
 */
export function listenToKeys(hold, keys) {
  offerSwitch();
  element('help', HTMLButtonElement).addEventListener('click', () => shortcuts.showModal());
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.isComposing || event.defaultPrevented) return;
    const isArrow = event.key.startsWith('Arrow');
    if (!areOn.checked && !isArrow) return;
    const action = isHold(event) ? hold : wanted(keys, event);
    if (action === undefined) return;
    if (!event.repeat || isArrow) action();
    event.preventDefault();
  });
}

function offerSwitch() {
  const show = () => document.body.classList.toggle('is-without-keys', !areOn.checked);
  areOn.checked = kept.read() !== 'off';
  show();
  areOn.addEventListener('change', () => {
    kept.write(areOn.checked ? 'on' : 'off');
    show();
  });
}

/** The action of a key; `undefined` if there is none. @param {Keys} keys @param {KeyboardEvent} event */
function wanted(keys, { key, shiftKey, target }) {
  if (shortcuts.open || (target instanceof Element && isTakenBy(target, key))) return undefined;
  if (key === '?') return () => shortcuts.showModal();
  return keys[/^[a-z]$/i.test(key) ? (shiftKey ? 'Shift+' : '') + key.toUpperCase() : key];
}

/** Whether the focused element uses the key itself. @param {Element} target @param {string} key */
function isTakenBy(target, key) {
  if (target.matches('input')) return true;
  if (key === ' ') return target.matches('button, a');
  return key.startsWith('Arrow') && target !== plan;
}

/** Whether the key is H, outside of text fields. Number fields do not accept an H. @param {KeyboardEvent} event */
function isHold({ key, target }) {
  const isText = target instanceof HTMLInputElement && ['text', 'password'].includes(target.type);
  return key.toUpperCase() === 'H' && !isText;
}
