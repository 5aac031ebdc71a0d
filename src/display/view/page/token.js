// @ts-check
// The token that control needs. It comes in the address's fragment, which no browser sends anywhere, and leaves the address
// bar at once, so that a look over the shoulder or a shared screen does not give it away.

import { ofTab } from './storage.js';

const kept = ofTab('bench-dragon.token');

/** Takes the token out of the address, where there is one, and returns the one that this tab has. */
export function takeToken() {
  const token = tokenIn(location.hash);
  if (token !== null) {
    keepToken(token);
    history.replaceState(null, '', location.pathname + location.search);
  }
  return kept.read();
}

/** Another address pasted into an open tab changes its fragment alone. @param {(token: string) => void} taken */
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
 * How a request shows the token: `Authorization` is left to a proxy that asks for a password.
 * @param {string} token
 */
export function tokenHeaders(token) {
  return { 'X-Bench-Dragon-Token': token };
}

/**
 * The token in an address, or in what somebody has pasted: the address, its fragment or the token alone.
 * @param {string} text
 * @returns {string | null}
 */
export function tokenIn(text) {
  const found = /(?:^|#token=)([\w-]{16,128})$/.exec(text.trim());
  return found === null ? null : found[1];
}
