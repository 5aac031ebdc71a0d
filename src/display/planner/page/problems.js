// @ts-check
// The list of problems, each with a button that goes to it.

import { element } from './element.js';
import { fixed, millimetres } from './format.js';

/** @typedef {import('./state.js').State} State */
/** @typedef {{level: 'danger' | 'caution' | 'good' | 'searched', text: string, time_s?: number, point_m?: [number, number], fixes?: import('./plan_message.js').Fix[]}} Problem */

const list = element('problems', HTMLUListElement);

/** @param {State} state @returns {Problem[]} */
export function problemsOf(state) {
  const { plan } = state;
  if (plan === null) return [];
  const fixes = (/** @type {string} */ problem, /** @type {number} */ at) => state.fixes.filter(({ of, dragon }) => of === problem && dragon === at);
  const contact = ofContact(state.contact).map((problem) => ({ ...problem, fixes: fixes('contact', 0) }));
  const stops = plan.routes.flatMap((route, at) => ofStop(route).map((problem) => ({ ...problem, fixes: fixes('stop', at) })));
  const found = [...contact, ...stops, ...state.borders.flatMap(ofBorder)];
  found.push(...state.misses.map(({ time_s, clearance_m, pair, point_m }) => ({
    level: /** @type {const} */ ('caution'),
    text: `${pair.words} come near: ${millimetres(clearance_m)} mm at ${fixed(time_s, 2)} s`,
    time_s,
    point_m,
  })));
  if (found.length > 0) return found;
  if (!state.isStudied) return [{ level: 'searched', text: 'none so far, still searching' }];
  return [{ level: 'good', text: 'none' }];
}

/** @param {import('./plan_message.js').Contact} contact @returns {Problem[]} */
function ofContact({ state, time_s, pair, point_m, to_s }) {
  if (state === 'found') return [{ level: 'danger', text: `${pair?.words} touch at ${fixed(time_s, 3)} s`, time_s, point_m }];
  if (state === 'searching') return [{ level: 'searched', text: `no contact up to ${fixed(to_s, 1)} s, searching on` }];
  if (state === 'unfinished') return [{ level: 'caution', text: `no contact up to ${fixed(to_s, 1)} s; later times take too much work` }];
  return [];
}

/** @param {import('./plan_message.js').RouteFacts} route @returns {Problem[]} */
function ofStop({ name, stops }) {
  if (stops === null) return [];
  const { because, time_s, point_m } = stops;
  return [{ level: 'danger', text: `${name ?? 'the dragon'} stops at ${fixed(time_s, 1)} s: ${because}`, time_s, point_m }];
}

/** @param {import('./plan_message.js').BorderFact} fact @returns {Problem[]} */
function ofBorder({ kind, bench, time_s, point_m, distance_m, clear_m }) {
  const at = `at ${fixed(time_s, 1)} s`;
  if (kind === 'outline') return [{ level: 'danger', text: `${bench} leaves the stage ${at}`, time_s, point_m }];
  if (kind === 'keep_out') return [{ level: 'danger', text: `${bench} is in an area to keep out of ${at}`, time_s, point_m }];
  if (distance_m === undefined || distance_m >= Math.max(clear_m ?? 0, Number.EPSILON)) return [];
  return [{ level: 'danger', text: `${bench} is ${fixed(distance_m, 2)} m from the crowd ${at}`, time_s, point_m }];
}

/**
 * Shows problems. The buttons keep the focus while numbers change.
 * @param {Problem[]} problems
 * @param {(problem: Problem) => void} go
 * @param {(fix: import('./plan_message.js').Fix) => void} fix
 */
export function showProblems(problems, go, fix) {
  while (list.children.length > problems.length) list.lastElementChild?.remove();
  problems.forEach((problem, at) => {
    const item = list.children[at] ?? list.appendChild(newItem());
    const [text, button, fixes] = /** @type {[HTMLSpanElement, HTMLButtonElement, HTMLSpanElement]} */ (/** @type {unknown} */ (item.children));
    /** @type {HTMLElement} */ (item).dataset.level = problem.level;
    if (text.textContent !== problem.text) text.textContent = problem.text;
    button.hidden = problem.time_s === undefined;
    button.setAttribute('aria-label', `Go to: ${problem.text}`);
    button.onclick = () => go(problem);
    showFixes(fixes, problem, fix);
  });
}

/** @param {HTMLElement} place @param {Problem} problem @param {(fix: import('./plan_message.js').Fix) => void} act */
function showFixes(place, { text, fixes = [] }, act) {
  while (place.children.length > fixes.length) place.lastElementChild?.remove();
  fixes.forEach((fix, at) => {
    const button = /** @type {HTMLButtonElement} */ (place.children[at] ?? place.appendChild(newButton('')));
    if (button.textContent !== fix.words) button.textContent = fix.words;
    button.setAttribute('aria-label', `Fix: ${fix.words}. ${text}`);
    button.onclick = () => act(fix);
  });
}

/** @param {string} word */
function newButton(word) {
  const button = document.createElement('button');
  button.type = 'button';
  button.textContent = word;
  return button;
}

function newItem() {
  const item = document.createElement('li');
  const fixes = document.createElement('span');
  fixes.className = 'fixes';
  item.append(document.createElement('span'), newButton('Go to'), fixes);
  return item;
}
