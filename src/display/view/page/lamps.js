// @ts-check
// The row of lamps: what the show consists of, and how each part is.

import { element } from './element.js';

/** @typedef {import('./show.js').Lamp} Lamp */

/** Lamps that are only there while they are lit: most shows have no such part, or nothing to say of it. */
const OPTIONAL = new Set(['source', 'psn', 'osc', 'zenoh', 'readers']);
/** What is only worth a lamp where it is not as usual. */
const QUIET = new Set(['source', 'readers']);

const row = element('lamps', HTMLUListElement);
let written = '';

/**
 * Lights the lamps. Where nothing is known any more, all are out.
 * @param {readonly Lamp[]} lamps
 * @param {boolean} isKnown
 */
export function lightLamps(lamps, isKnown) {
  const there = lamps.filter(
    ({ name, level }) => !(OPTIONAL.has(name) && level === 'off') && !(QUIET.has(name) && level === 'good'),
  );
  const shown = isKnown ? there : there.map(({ name }) => ({ name, level: 'off', text: 'not known' }));
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
