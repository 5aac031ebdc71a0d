// @ts-check
import { element, write } from './element.js';
import * as format from './format.js';

/** @typedef {import('./show.js').Alert} Alert */

const list = element('alerts', HTMLOListElement);

/**
 * Lists the alerts, newest first; what is listed already stays as it is. Those of earlier runs step back.
 * @param {readonly Alert[]} alerts oldest first
 * @param {number | undefined} run_id of the run that is shown
 */
export function listAlerts(alerts, run_id) {
  const listed = new Map([...list.children].map((row) => [row instanceof HTMLElement ? row.dataset.key : '', row]));
  const rows = alerts.map((alert) => listed.get(alertKey(alert)) ?? row(alert)).reverse();
  rows.forEach((item, at) => item.classList.toggle('is-earlier', alerts[alerts.length - 1 - at].run_id !== run_id));
  if (rows.length !== list.children.length || rows[0] !== list.firstChild) list.replaceChildren(...rows);
  element('no-alerts', HTMLElement).hidden = alerts.length > 0;
  list.hidden = alerts.length === 0;
  write(element('alerts-count', HTMLElement), alerts.length === 0 ? '' : String(alerts.length));
}

/** Tells alerts of different views and runs apart. @param {Alert} alert */
export function alertKey({ number, run_id, kind, time_s }) {
  return `${number} ${run_id} ${kind} ${time_s}`;
}

/** @param {Alert} alert */
function row(alert) {
  const { kind, time_s, benches, clearance_m, forecast_s } = alert;
  const item = document.createElement('li');
  item.className = 'alert';
  item.dataset.kind = kind;
  item.dataset.key = alertKey(alert);
  const what = [];
  if (benches !== null) what.push(`${benches[0]} · ${benches[1]}`);
  if (clearance_m !== null) what.push(`${format.millimetres(clearance_m)} mm`);
  if (kind === 'held' && forecast_s !== null) what.push(`contact at ${format.showTime(forecast_s)} s`);
  item.append(text('b', capital(kind)), text('span', what.join(', ')), text('time', `${format.showTime(time_s)} s`));
  return item;
}

/** @param {string} tag @param {string} content */
function text(tag, content) {
  const made = document.createElement(tag);
  made.textContent = content;
  return made;
}

/** @param {string} word */
const capital = (word) => word.charAt(0).toUpperCase() + word.slice(1);
