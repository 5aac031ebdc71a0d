// @ts-check
// The numbers of a plan. Those that are still searched are grey.

import { element, write } from './element.js';
import { fixed, millimetres } from './format.js';

/** @typedef {import('./state.js').State} State */
/** @typedef {{name: string, value: string, isSearched: boolean}} Row */

const list = element('numbers', HTMLDListElement);

/** @param {State} state @returns {Row[]} */
export function numbersOf(state) {
  const { plan, samples, contact } = state;
  if (plan === null) return [];
  const named = (/** @type {number} */ at) => (plan.routes.length > 1 ? ` (${plan.routes[at].name})` : '');
  const longest = most(plan.routes.map(({ length_m }) => length_m));
  const tightest = most(plan.routes.map(({ tightest_radius_m }) => -(tightest_radius_m ?? Infinity)));
  const fastest = most(state.speeds.map(({ ratio }) => ratio ?? -Infinity));
  const crowd = crowdDistance(state);
  const least = samples.reduce((least_m, { clearance_m }) => Math.min(least_m, clearance_m), Infinity);
  const rows = [
    row('Route', `${fixed(longest.value, 3)} m${named(longest.at)}`, false),
    row('Duration', `${fixed(plan.times_s[1] - plan.times_s[0], 3)} s`, false),
    row('Tightest bend', Number.isFinite(tightest.value) ? `${fixed(-tightest.value, 3)} m${named(tightest.at)}` : 'straight', false),
    row('First contact', contactWord(contact), contact.state === 'searching'),
    row('Fastest handle', speedWord(state, fastest, named), !state.isStudied),
    row('Least clearance', Number.isFinite(least) ? `${state.isCurveComplete || state.isCurveOld ? '' : '≤ '}${millimetres(Math.max(least, 0))} mm` : '–', state.isCurveOld || !state.isCurveComplete),
  ];
  if (crowd !== null) rows.push(row('Crowd', `${state.areBordersKnown ? '' : '≤ '}${fixed(crowd, 3)} m`, !state.areBordersKnown));
  return rows;
}

/**
 * The least distance of a board from the crowd; until it is known, that of a handle at the shown time. `null` without a crowd.
 * @param {State} state
 */
function crowdDistance({ plan, pose, borders, areBordersKnown }) {
  const line = plan?.run.crowd ?? [];
  if (line.length < 4) return null;
  if (areBordersKnown) return borders.filter(({ kind }) => kind === 'crowd').reduce((least_m, { distance_m }) => Math.min(least_m, distance_m ?? Infinity), Infinity);
  let least_m = Infinity;
  for (let at = 0; at + 1 < pose.handles.length; at += 2) {
    for (let side = 0; side + 3 < line.length; side += 2) least_m = Math.min(least_m, distanceFrom(pose.handles[at], pose.handles[at + 1], line.slice(side, side + 4)));
  }
  return least_m;
}

/** The distance of a point from a straight line between two others. @param {number} x @param {number} y @param {number[]} line */
function distanceFrom(x, y, [ax, ay, bx, by]) {
  const [ux, uy] = [bx - ax, by - ay];
  const share = Math.min(Math.max(((x - ax) * ux + (y - ay) * uy) / (ux * ux + uy * uy || 1), 0), 1);
  return Math.hypot(ax + share * ux - x, ay + share * uy - y);
}

/** @param {string} name @param {string} value @param {boolean} isSearched @returns {Row} */
const row = (name, value, isSearched) => ({ name, value, isSearched });

/** The largest of some values, and its index. @param {number[]} values */
function most(values) {
  const value = Math.max(...values, -Infinity);
  return { value, at: Math.max(values.indexOf(value), 0) };
}

/** @param {import('./plan_message.js').Contact} contact */
function contactWord({ state, time_s, to_s }) {
  if (state === 'found') return `${fixed(time_s, 6)} s`;
  if (state === 'none') return 'none';
  return `none up to ${fixed(to_s, 1)} s`;
}

/** @param {State} state @param {{value: number, at: number}} fastest @param {(at: number) => string} named */
function speedWord(state, fastest, named) {
  if (Number.isFinite(fastest.value)) return `${fixed(fastest.value, 3)} × head${named(fastest.at)}`;
  // The head is a handle, too.
  return state.speeds.length > 0 ? 'unknown' : '≥ 1.000 × head';
}

/** @param {Row[]} rows */
export function showNumbers(rows) {
  while (list.children.length > rows.length) list.lastElementChild?.remove();
  rows.forEach(({ name, value, isSearched }, at) => {
    const item = /** @type {HTMLElement} */ (list.children[at] ?? list.appendChild(newItem()));
    item.dataset.searched = String(isSearched);
    write(item.children[0], name);
    write(item.children[1], value);
  });
}

function newItem() {
  const item = document.createElement('div');
  item.append(document.createElement('dt'), document.createElement('dd'));
  return item;
}
