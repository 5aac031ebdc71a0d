// @ts-check
// The row of lamps: the state of each part of the show.

import { element } from './element.js';

/** @typedef {import('./show.js').Lamp} Lamp */

/** Lamps that are hidden while off, since most shows do not have these parts. */
const OPTIONAL = new Set(['source', 'psn', 'osc', 'zenoh', 'foxglove', 'timecode-out', 'readers']);
/** Lamps that are hidden while good. */
const QUIET = new Set(['source', 'readers']);

/** The levels, the worst one first. */
const RANKS = ['danger', 'warning', 'good', 'off'];

const row = element('lamps', HTMLUListElement);
let written = '';

/**
 * Draws the lamps, the worst ones first. If their state is no longer known, all are off.
 * @param {readonly Lamp[]} lamps
 * @param {boolean} isKnown
 */
export function lightLamps(lamps, isKnown) {
  const there = lamps.filter(
    ({ name, level }) => !(OPTIONAL.has(name) && level === 'off') && !(QUIET.has(name) && level === 'good'),
  );
  const known = [...there].sort((a, b) => RANKS.indexOf(a.level) - RANKS.indexOf(b.level));
  const shown = isKnown ? known : there.map(({ name }) => ({ name, level: 'off', text: 'unknown' }));
  const text = JSON.stringify(shown);
  if (text === written) return;
  written = text;
  row.hidden = shown.length === 0;
  row.replaceChildren(
    ...shown.map(({ name, level, text }) => {
      const lamp = document.createElement('li');
      lamp.className = 'lamp';
      lamp.dataset.name = name;
      lamp.dataset.level = level;
      lamp.title = `${name}: ${text}`;
      const [title, state] = ['b', 'span'].map((tag) => document.createElement(tag));
      title.textContent = name;
      state.textContent = text;
      lamp.append(title, state);
      return lamp;
    }),
  );
}
