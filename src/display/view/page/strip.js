// @ts-check
// The state of the show: the strip on top, the wall, and the page's title.

import { element, write } from './element.js';

/** @typedef {import('./standing.js').Standing} Standing */
/**
 * @typedef {object} Signs what the strip and the wall show beside the state
 * @property {{tag: string, text: string} | null} danger a contact or an overlap, which makes the strip red in every state; `text`
 *   precedes the explanation of the state
 * @property {string} clock
 * @property {string} left
 * @property {string} next
 * @property {string} clearance
 */

const html = (/** @type {string} */ id) => element(id, HTMLElement);
const wall = html('wall');

/** Whether this page is a wall: for a second screen, without controls. */
export const isWall = new URLSearchParams(location.search).has('wall');
document.body.classList.toggle('is-wall', isWall);
wall.hidden = !isWall;

/**
 * @param {Standing} standing
 * @param {Signs} signs
 * @param {string} instance
 * @param {import('./show.js').Show} show
 */
export function writeStrip(standing, signs, instance, show) {
  const { status, word, isLive, isLost } = standing;
  const { dataset } = document.body;
  if (dataset.status !== status) {
    dataset.status = status;
    dataset.live = String(isLive);
    dataset.stripes = String(isLost);
    // Time from the arrival of the last picture until the page stopped showing it as live.
    dataset.shownAfterMs = String(Math.round(performance.now() - show.frame_ms));
    document.title = `${word} – ${instance || 'bench-dragon'}`;
  }
  const danger = isLive ? signs.danger : null;
  const { tag, text } = danger ?? { tag: '', text: '' };
  dataset.danger = String(danger !== null);
  const shape = `#shape-${danger === null ? standing.shape : 'danger'}`;
  for (const id of ['shape', 'wall-shape']) {
    const use = element(id, SVGUseElement);
    if (use.getAttribute('href') !== shape) use.setAttribute('href', shape);
  }
  html('danger').hidden = danger === null;
  write(html('danger'), tag);
  html('source').hidden = show.status?.server?.source !== 'replay';
  write(html('word'), word);
  write(html('explanation'), text + standing.explanation);
  write(html('wall-clock'), signs.clock);
  write(html('time-left'), signs.left);
  if (isWall) writeWall(standing, signs, tag);
}

/** @param {Standing} standing @param {Signs} signs @param {string} tag */
function writeWall({ word }, { clock, left, next, clearance }, tag) {
  write(html('wall-word'), tag === '' ? word : `${word} ${tag}`);
  write(html('wall-time'), clock);
  write(html('wall-left'), left);
  write(html('wall-next'), next);
  write(html('wall-clearance'), `${clearance} mm`);
}
