// @ts-check
// The list of the cues: those that the show has reached, the next one, and those ahead.

import { element, write } from './element.js';
import * as format from './format.js';

/** @typedef {import('./cue_words.js').Cue} Cue */
/** @typedef {import('./cue_words.js').CueList} CueList */

const WORDS = { reached: 'done', waiting: 'waits for GO', next: 'next', ahead: '' };

const list = element('cues', HTMLOListElement);
const tab = element('cues-tab', HTMLButtonElement);
let listed = '';

/**
 * Lists the cues. The tab is shown, and chosen at first, for a show with cues.
 * @param {CueList | null} cues
 * @param {(at_s: number) => void} choose called with the plan time of a cue whose name is pressed
 */
export function listCues(cues, choose) {
  const signature = cues === null ? '' : JSON.stringify(cues.cues);
  if (signature === listed) return;
  const isFirst = listed === '';
  listed = signature;
  tab.hidden = cues === null;
  if (cues === null) return;
  list.replaceChildren(...cues.cues.map((cue) => row(cue, choose)));
  const left = cues.cues.filter(({ state }) => state !== 'reached').length;
  write(element('cues-count', HTMLElement), left === 0 ? '' : String(left));
  if (isFirst) tab.click();
  // The page itself never scrolls by itself.
  const next = list.querySelector('[data-state="waiting"], [data-state="next"]');
  if (next instanceof HTMLElement) list.scrollTop = next.offsetTop - list.offsetTop;
}

/** @param {Cue} cue @param {(at_s: number) => void} choose */
function row(cue, choose) {
  const item = document.createElement('li');
  item.className = 'cue';
  item.dataset.state = cue.state;
  if (cue.state === 'waiting' || cue.state === 'next') item.setAttribute('aria-current', 'step');
  const effects = [];
  if (cue.waits && cue.state !== 'waiting') effects.push('waits');
  if (cue.speed_mps !== null) effects.push(`${cue.dragon === null ? '' : `${cue.dragon} `}${cue.speed_mps} m/s`);
  const state = WORDS[cue.state] === '' ? effects.join(', ') : [WORDS[cue.state], ...effects].join(', ');
  const name = document.createElement('button');
  name.type = 'button';
  name.className = 'cue-name';
  name.textContent = cue.name;
  name.title = `Propose a seek to ${cue.name}`;
  name.addEventListener('click', () => choose(cue.at_s));
  item.append(text('time', `${format.fixed(cue.at_s, 1)} s`), name, text('span', state), text('span', cue.note ?? ''));
  return item;
}

/** @param {string} tag @param {string} content */
function text(tag, content) {
  const made = document.createElement(tag);
  made.textContent = content;
  return made;
}
