// @ts-check
// The filter of the list of alerts, by kind, and the urgency of a kind.

import { SEVERITIES } from './words.js';

/** @typedef {import('./show.js').Alert} Alert */

/** Kinds of alerts, the most urgent first. */
const KINDS = [...SEVERITIES.keys()];

/** The urgency of a kind; of a kind that this version does not support, caution. @param {string} kind */
export const severityOf = (kind) => SEVERITIES.get(kind) ?? 'caution';

export class AlertFilter {
  /** @type {Set<string>} */ #hidden = new Set();

  /** Hides a kind, or shows it again. @param {string} kind */
  toggle(kind) {
    if (!this.#hidden.delete(kind)) this.#hidden.add(kind);
  }

  /** @param {string} kind */
  isShown(kind) {
    return !this.#hidden.has(kind);
  }

  /** @param {readonly Alert[]} alerts */
  listed(alerts) {
    return alerts.filter(({ kind }) => this.isShown(kind));
  }
}

/**
 * The kinds among some alerts, the most urgent first, with the number of alerts of each.
 * @param {readonly Alert[]} alerts
 * @returns {[string, number][]}
 */
export function countKinds(alerts) {
  /** @type {Map<string, number>} */
  const counts = new Map();
  for (const { kind } of alerts) counts.set(kind, (counts.get(kind) ?? 0) + 1);
  const weight = (/** @type {string} */ kind) => (KINDS.includes(kind) ? KINDS.indexOf(kind) : KINDS.length);
  return [...counts].sort(([one], [other]) => weight(one) - weight(other));
}
