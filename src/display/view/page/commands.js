// @ts-check
// The list of the newest commands, with their senders and outcomes.

import { element, write } from './element.js';
import * as format from './format.js';

/**
 * @typedef {object} CommandEvent
 * @property {number} number
 * @property {number} run_id
 * @property {number} tick
 * @property {number} time_s show time
 * @property {number} pid process id of the sender; 0 if it is unknown
 * @property {string} clock wall time of the view's machine
 * @property {string} sender
 * @property {string} action
 * @property {boolean} accepted
 * @property {string | null} reason of a refusal
 */

const list = element('commands', HTMLOListElement);

/**
 * Lists the commands, newest first. Existing rows are kept.
 * @param {readonly CommandEvent[]} events oldest first
 */
export function listCommands(events) {
  const listed = new Map([...list.children].map((row) => [row instanceof HTMLElement ? row.dataset.key : '', row]));
  const rows = events.map((event) => listed.get(keyOf(event)) ?? row(event)).reverse();
  if (rows.length !== list.children.length || rows[0] !== list.firstChild) list.replaceChildren(...rows);
  element('no-commands', HTMLElement).hidden = events.length > 0;
  list.hidden = events.length === 0;
  write(element('commands-count', HTMLElement), events.length === 0 ? '' : String(events.length));
}

/** @param {CommandEvent} event */
function keyOf({ number, run_id, tick, clock }) {
  return `${number} ${run_id} ${tick} ${clock}`;
}

/** @param {CommandEvent} event */
function row(event) {
  const { clock, sender, action, accepted, reason, tick, time_s, pid } = event;
  const item = document.createElement('li');
  item.className = 'command';
  item.dataset.key = keyOf(event);
  item.dataset.accepted = String(accepted);
  item.title = `show time ${format.fixed(time_s, 3)} s${pid === 0 ? '' : `, process ${pid}`}`;
  const outcome = accepted ? `from tick ${format.count(tick)}` : `refused at tick ${format.count(tick)}: ${reason}`;
  item.append(text('time', clock), text('b', sender), text('span', action), text('span', outcome));
  return item;
}

/** @param {string} tag @param {string} content */
function text(tag, content) {
  const made = document.createElement(tag);
  made.textContent = content;
  return made;
}
