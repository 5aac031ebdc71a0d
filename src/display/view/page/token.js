// @ts-check
// The token that commands need. It arrives in the address's fragment, which no browser sends anywhere. The page removes it from
// the address bar at once, so that other people at the screen do not see it.

import { ofTab } from './storage.js';

const kept = ofTab('bench-dragon.token');

/** Moves the token from the address, if it has one, to the tab's storage. Returns the tab's token. */
export function takeToken() {
  const token = tokenIn(location.hash);
  if (token !== null) {
    keepToken(token);
    history.replaceState(null, '', location.pathname + location.search);
  }
  return kept.read();
}

/** Listens for an address pasted into an open tab, which changes only its fragment. @param {(token: string) => void} taken */
export function listenToAddress(taken) {
  addEventListener('hashchange', () => {
    const isGiven = tokenIn(location.hash) !== null;
    const token = takeToken();
    if (isGiven && token !== null) taken(token);
  });
}

/** @param {string} token */
export function keepToken(token) {
  kept.write(token);
}

/**
 * The headers of a request with the token. `Authorization` stays free for a proxy that requires a password.
 * @param {string} token
 */
export function tokenHeaders(token) {
  return { 'X-Bench-Dragon-Token': token };
}

/**
 * The token in a pasted text: an address, its fragment, or only the token; `null` if there is none.
 * @param {string} text
 * @returns {string | null}
 */
export function tokenIn(text) {
  const found = /(?:^|#token=)([\w-]{16,128})$/.exec(text.trim());
  return found === null ? null : found[1];
}
