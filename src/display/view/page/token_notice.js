// @ts-check
// The notice that asks for the token: where viewing needs it, and where a view was restarted with another one.

import { element, write } from './element.js';
import { keepToken, tokenIn } from './token.js';

/** @typedef {import('./connection.js').Access} Access */

const notice = element('token-notice', HTMLElement);
const field = element('token-field', HTMLInputElement);
const MISSING = 'This view needs the address with the token.';
const OTHER =
  'This page can no longer steer: the view was started again with another token. Paste its new address. With BENCH_DRAGON_TOKEN, a token stays the same.';

/** @param {Access} access @param {boolean} hasToken whether the page has a token, valid or not */
export function askForToken({ may_view, may_control, read_only }, hasToken) {
  const isOther = hasToken && !may_control && !read_only;
  notice.hidden = may_view && !isOther;
  write(element('token-text', HTMLElement), isOther ? OTHER : MISSING);
}

/** Calls back with each token that the user enters. @param {(token: string) => void} taken */
export function listenToField(taken) {
  element('token-form', HTMLFormElement).addEventListener('submit', (event) => {
    event.preventDefault();
    const token = tokenIn(field.value);
    if (token === null) return;
    field.value = '';
    keepToken(token);
    taken(token);
  });
}
