// @ts-check
// Keyboard shortcuts, and the list of them. None acts while somebody types, or with Ctrl, Alt or Meta.

import { element } from './element.js';

/**
 * What each key does, by its name; letters in upper case, after `Shift+` with Shift.
 * @typedef {Record<string, () => void>} Keys
 */

const shortcuts = element('shortcuts', HTMLDialogElement);

/** @param {Keys} keys */
export function listenToKeys(keys) {
  element('help', HTMLButtonElement).addEventListener('click', () => shortcuts.showModal());
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented || shortcuts.open) return;
    if (event.target instanceof Element && isTakenBy(event.target, event.key)) return;
    const isLetter = /^[a-z]$/i.test(event.key);
    const name = isLetter ? (event.shiftKey ? 'Shift+' : '') + event.key.toUpperCase() : event.key;
    if (event.key === '?') shortcuts.showModal();
    else if (keys[name] === undefined || (event.repeat && !event.key.startsWith('Arrow'))) return;
    else keys[name]();
    event.preventDefault();
  });
}

/** Whether what has the focus uses the key itself. @param {Element} target @param {string} key */
function isTakenBy(target, key) {
  if (target.matches('input')) return true;
  if (key === ' ') return target.matches('button, a');
  return key.startsWith('Arrow') && target.matches('.alert-list, [role="slider"]');
}
