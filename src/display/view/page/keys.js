// @ts-check
// Keyboard shortcuts, and the list of them, where they can be switched off: whoever dictates to a browser, or shakes, types
// letters that were not meant. With Ctrl, Alt or Meta a key is the browser's.

import { element } from './element.js';
import { ofBrowser } from './storage.js';

/**
 * What each key does, by its name; letters in upper case, after `Shift+` with Shift.
 * @typedef {Record<string, () => void>} Keys
 */

const kept = ofBrowser('bench-dragon.keys');
const shortcuts = element('shortcuts', HTMLDialogElement);
const areOn = element('keys-are-on', HTMLInputElement);
const plan = element('plan-area', HTMLElement);

/**
 * @param {() => void} hold what H does: wherever the focus is, in either case, over the list of keys too
 * @param {Keys} keys the others, where nothing else wants them
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

/** What a key does, if anything. @param {Keys} keys @param {KeyboardEvent} event */
function wanted(keys, { key, shiftKey, target }) {
  if (shortcuts.open || (target instanceof Element && isTakenBy(target, key))) return undefined;
  if (key === '?') return () => shortcuts.showModal();
  return keys[/^[a-z]$/i.test(key) ? (shiftKey ? 'Shift+' : '') + key.toUpperCase() : key];
}

/** Whether what has the focus uses the key itself. @param {Element} target @param {string} key */
function isTakenBy(target, key) {
  if (target.matches('input')) return true;
  if (key === ' ') return target.matches('button, a');
  return key.startsWith('Arrow') && target !== plan;
}

/** An h holds, except in a text; no number has one. @param {KeyboardEvent} event */
function isHold({ key, target }) {
  const isText = target instanceof HTMLInputElement && ['text', 'password'].includes(target.type);
  return key.toUpperCase() === 'H' && !isText;
}
