// @ts-check
// The state of the show: the strip on top, the wall, and the page's title.

import { element, write } from './element.js';
import { writeSentences } from './sentence.js';

/** @typedef {import('./standing.js').Standing} Standing */
/**
 * @typedef {object} Signs what the strip and the wall show beside the state
 * @property {string} contact `CONTACT` or `OVERLAP`, which makes the strip red in every state; empty without one
 * @property {string} clock
 * @property {string} left
 * @property {string} next
 * @property {string} clearance
 */

const html = (/** @type {string} */ id) => element(id, HTMLElement);
const wall = html('wall');
/** Greatest length of cause and remedy together in the strip, in characters. */
const MOST_IN_STRIP = 130;

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
  const tag = isLive ? signs.contact : '';
  dataset.level = standing.level;
  dataset.danger = String(tag !== '' || (isLive && standing.level === 'danger'));
  dataset.contact = String(tag !== '');
  const shape = `#shape-${tag === '' ? standing.shape : 'danger'}`;
  for (const id of ['shape', 'wall-shape']) {
    const use = element(id, SVGUseElement);
    if (use.getAttribute('href') !== shape) use.setAttribute('href', shape);
  }
  html('danger').hidden = tag === '';
  write(html('danger'), tag);
  html('source').hidden = show.status?.server?.source !== 'replay';
  write(html('word'), word);
  writeReason(standing);
  write(html('wall-clock'), signs.clock);
  write(html('time-left'), signs.left);
  if (isWall) writeWall(standing, signs, tag);
}

/** Writes the cause and the remedy into the strip, or a long remedy below HOLD. @param {Standing} standing */
function writeReason({ explanation, remedy }) {
  const whole = remedy === null ? explanation : `${explanation} ${remedy}`;
  const fits = whole.length <= MOST_IN_STRIP;
  writeSentences(html('explanation'), fits ? whole : explanation);
  html('remedy').hidden = fits;
  writeSentences(html('remedy-text'), fits || remedy === null ? '' : remedy);
}

/** A danger other than a contact has its reason in place of the next event. @param {Standing} standing @param {Signs} signs @param {string} tag */
function writeWall({ word, level, explanation }, { clock, left, next, clearance }, tag) {
  const isReason = level === 'danger' && tag === '' && explanation !== '';
  write(html('wall-word'), tag === '' ? word : `${word} ${tag}`);
  write(html('wall-time'), clock);
  write(html('wall-left'), left);
  html('wall-next').classList.toggle('is-reason', isReason);
  write(html('wall-next'), isReason ? explanation : next);
  write(html('wall-clearance'), `${clearance} mm`);
}
