// @ts-check
// The state of the show: the strip on top, the banner over a picture that is not live, and the page's title.

import { element, write } from './element.js';

/** @typedef {import('./standing.js').Standing} Standing */

const html = (/** @type {string} */ id) => element(id, HTMLElement);

/**
 * @param {Standing} standing
 * @param {string} instance
 * @param {import('./show.js').Show} show
 */
export function writeStrip({ status, word, shape, explanation, isLive }, instance, show) {
  const { dataset } = document.body;
  if (dataset.status !== status) {
    dataset.status = status;
    dataset.live = String(isLive);
    // Time from the arrival of the last picture until the page stopped showing it as live.
    dataset.shownAfterMs = String(Math.round(performance.now() - show.frame_ms));
    for (const id of ['shape', 'banner-shape']) element(id, SVGUseElement).setAttribute('href', `#shape-${shape}`);
    html('banner').hidden = isLive;
    document.title = `${word} – ${instance || 'bench-dragon'}`;
  }
  const isReplay = show.status?.server?.source === 'replay';
  html('source').hidden = !isReplay;
  write(html('word'), word);
  write(html('explanation'), explanation);
  write(html('banner-word'), word);
  write(html('banner-text'), explanation);
}
