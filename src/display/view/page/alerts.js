// @ts-check
import { AlertFilter, countKinds, severityOf } from './alert_filter.js';
import { element, write } from './element.js';
import * as format from './format.js';

/** @typedef {import('./show.js').Alert} Alert */

const list = element('alerts', HTMLOListElement);
const kinds = element('alert-kinds', HTMLElement);
const none = element('no-alerts', HTMLElement);
const filter = new AlertFilter();
/** The reason for which no monitor searches for contacts; `null` if one does. @type {string | null} */
let unwatched = null;
/** @type {readonly Alert[]} */
let alerts = [];
/** @type {number | undefined} */
let run_id;

/**
 * Lists the alerts, newest first. Existing rows are kept. Alerts of earlier runs are grey.
 * @param {readonly Alert[]} newest oldest first
 * @param {number | undefined} shown_run_id the shown run
 * @param {string | null} reason the reason for which no monitor searches for contacts; `null` if one does
 */
export function listAlerts(newest, shown_run_id, reason) {
  [alerts, run_id, unwatched] = [newest, shown_run_id, reason];
  offerKinds();
  const shown = filter.listed(alerts);
  const listed = new Map([...list.children].map((row) => [row instanceof HTMLElement ? row.dataset.key : '', row]));
  const rows = shown.map((alert) => listed.get(alertKey(alert)) ?? row(alert)).reverse();
  rows.forEach((item, at) => item.classList.toggle('is-earlier', shown[shown.length - 1 - at].run_id !== run_id));
  if (rows.length !== list.children.length || rows[0] !== list.firstChild) list.replaceChildren(...rows);
  const hidden = alerts.length - shown.length;
  write(none, unwatched ?? (hidden > 0 ? `${hidden} not listed.` : 'None so far.'));
  none.dataset.warns = String(unwatched !== null);
  none.hidden = alerts.length > 0 && unwatched === null && hidden === 0;
  list.hidden = shown.length === 0;
  write(element('alerts-count', HTMLElement), alerts.length === 0 ? '' : String(alerts.length));
}

/** Makes a button for each kind among the alerts, if there are several alerts. */
function offerKinds() {
  const counts = alerts.length > 1 ? countKinds(alerts) : [];
  const text = JSON.stringify(counts.map(([kind, count]) => [kind, count, filter.isShown(kind)]));
  if (kinds.dataset.counts === text) return;
  kinds.dataset.counts = text;
  const focused = document.activeElement instanceof HTMLElement ? document.activeElement.dataset.kind : undefined;
  kinds.hidden = counts.length === 0;
  kinds.replaceChildren(...counts.map(([kind, count]) => kindButton(kind, count)));
  for (const one of kinds.children) if (one instanceof HTMLElement && one.dataset.kind === focused) one.focus();
}

/** @param {string} kind @param {number} count */
function kindButton(kind, count) {
  const made = document.createElement('button');
  made.type = 'button';
  made.className = 'kind';
  made.dataset.kind = kind;
  made.setAttribute('aria-pressed', String(filter.isShown(kind)));
  made.textContent = `${format.spaced(kind)} ${count}`;
  made.addEventListener('click', () => {
    filter.toggle(kind);
    listAlerts(alerts, run_id, unwatched);
  });
  return made;
}

/** The key of an alert, unique over views and runs. @param {Alert} alert */
export function alertKey({ number, run_id, kind, time_s }) {
  return `${number} ${run_id} ${kind} ${time_s}`;
}

/** @param {Alert} alert */
function row(alert) {
  const { kind, time_s, benches, bench, dragons, indices, clearance_m, forecast_s } = alert;
  const item = document.createElement('li');
  item.className = 'alert';
  item.dataset.kind = kind;
  item.dataset.severity = severityOf(kind);
  item.dataset.key = alertKey(alert);
  const what = [];
  const names = dragons?.map((name, at) => `${name} ${indices?.[at]}`);
  if (benches !== null) what.push((names ?? benches).join(' · '));
  if (bench !== null) what.push(names === undefined ? `bench ${bench}` : names[0]);
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
const capital = (word) => word.charAt(0).toUpperCase() + format.spaced(word).slice(1);
