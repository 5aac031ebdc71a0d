// @ts-check
// Announcements for screen readers: changes of state and alerts, never every frame.

import { severityOf } from './alert_filter.js';
import { element } from './element.js';
import * as format from './format.js';

/** @typedef {import('./show.js').Alert} Alert */

const GATHER_MS = 250;

export class Announcer {
  #polite = element('polite', HTMLElement);
  #assertive = element('assertive', HTMLElement);
  #status = '';
  /** @type {Alert[]} */ #alerts = [];

  /** @param {import('./standing.js').Standing} standing */
  standing({ status, word, explanation, remedy }) {
    if (status === this.#status) return;
    this.#status = status;
    (status === 'held' ? this.#assertive : this.#polite).textContent = [`${word}.`, explanation, remedy ?? ''].join(' ').trim();
  }

  /** Announces an alert. Alerts within a quarter of a second share one announcement. @param {Alert} alert */
  alert(alert) {
    this.#alerts.push(alert);
    if (this.#alerts.length > 1) return;
    setTimeout(() => {
      const alerts = this.#alerts;
      this.#alerts = [];
      const isUrgent = (/** @type {Alert} */ { kind }) => severityOf(kind) === 'danger';
      const chosen = alerts.findLast(isUrgent) ?? alerts[alerts.length - 1];
      const more = alerts.length > 1 ? ` ${alerts.length} alerts in all.` : '';
      (isUrgent(chosen) ? this.#assertive : this.#polite).textContent = sentence(chosen) + more;
    }, GATHER_MS);
  }
}

/** @param {Alert} alert */
function sentence({ kind, time_s, benches, bench, dragons, indices, clearance_m }) {
  const one = dragons === undefined ? `bench ${bench}` : `${dragons[0]} ${indices?.[0]}`;
  const who = benches !== null ? `, ${format.pair({ benches, dragons, indices })}` : bench !== null ? `, ${one}` : '';
  const what = clearance_m === null ? '' : `, ${format.millimetres(clearance_m)} millimetres`;
  return `Alert: ${format.spaced(kind)}${who}${what}, at ${format.showTime(time_s)} seconds.`;
}
