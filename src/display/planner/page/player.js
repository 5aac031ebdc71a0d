// @ts-check
// The cursor over plan time: dragged, moved by keys, or played.

import { element, write } from './element.js';
import { fixed } from './format.js';

/** @typedef {{now_s: number, times_s: [number, number], tick_s: number}} Place */

const button = element('play', HTMLButtonElement);
const pace = element('pace', HTMLSelectElement);
const ticks = { 'tick-back': -1, 'tick-on': 1 };
/** Steps of the arrow keys, in seconds. */
const [STEP_S, LARGE_STEP_S] = [0.1, 5];

export class Player {
  #seek;
  #place;
  #isPlaying = false;
  #time_s = 0;
  #drawn_ms = 0;

  /** @param {(time_s: number) => void} seek @param {() => Place | null} place */
  constructor(seek, place) {
    this.#seek = seek;
    this.#place = place;
    button.addEventListener('click', () => this.toggle());
    for (const [id, step] of Object.entries(ticks)) element(id, HTMLButtonElement).addEventListener('click', () => this.tick(step));
  }

  toggle() {
    const place = this.#place();
    if (this.#isPlaying || place === null) return this.stop();
    const [start_s, end_s] = place.times_s;
    this.#time_s = place.now_s >= end_s - 1e-6 ? start_s : place.now_s;
    this.#isPlaying = true;
    this.#drawn_ms = performance.now();
    requestAnimationFrame((now_ms) => this.#turn(now_ms));
    this.show();
  }

  stop() {
    this.#isPlaying = false;
    this.show();
  }

  show() {
    button.disabled = this.#place() === null;
    for (const id of Object.keys(ticks)) element(id, HTMLButtonElement).disabled = button.disabled;
    write(button, this.#isPlaying ? 'Stop' : 'Play');
  }

  /** Goes on by ticks of the server. @param {number} count */
  tick(count) {
    const place = this.#place();
    if (place === null) return;
    const { now_s, times_s, tick_s } = place;
    // The nearest tick, so that rounding does not add up.
    const tick = Math.round((now_s - times_s[0]) / tick_s) + count;
    this.#to(Math.min(Math.max(times_s[0] + tick * tick_s, times_s[0]), times_s[1]));
  }

  /** @param {number} now_ms */
  #turn(now_ms) {
    const place = this.#place();
    if (!this.#isPlaying || place === null) return;
    this.#time_s += (Math.max(now_ms - this.#drawn_ms, 0) / 1000) * Number(pace.value);
    this.#drawn_ms = now_ms;
    this.#seek(Math.min(this.#time_s, place.times_s[1]));
    if (this.#time_s >= place.times_s[1]) return this.stop();
    requestAnimationFrame((next_ms) => this.#turn(next_ms));
  }

  /** Describes the cursor to a screen reader. @param {HTMLElement} slider */
  describe(slider) {
    const place = this.#place();
    if (place === null) return;
    const values = { min: place.times_s[0], max: place.times_s[1], now: place.now_s };
    for (const [name, value] of Object.entries(values)) slider.setAttribute(`aria-value${name}`, value.toFixed(3));
    slider.setAttribute('aria-valuetext', `${fixed(place.now_s, 2)} seconds`);
  }

  /** @param {HTMLElement} slider @param {(x: number) => number | null} timeAt */
  listenTo(slider, timeAt) {
    const drag = (/** @type {PointerEvent} */ event) => {
      const time_s = timeAt(event.clientX - slider.getBoundingClientRect().left);
      if (time_s !== null) this.#to(time_s);
    };
    slider.addEventListener('pointerdown', (event) => {
      slider.setPointerCapture(event.pointerId);
      drag(event);
    });
    slider.addEventListener('pointermove', (event) => {
      if (slider.hasPointerCapture(event.pointerId)) drag(event);
    });
    slider.addEventListener('keydown', (event) => {
      const place = this.#place();
      if (place === null || event.ctrlKey || event.metaKey) return;
      const step_s = event.shiftKey ? LARGE_STEP_S : STEP_S;
      const { now_s, times_s } = place;
      const to_s = { ArrowLeft: now_s - step_s, ArrowRight: now_s + step_s, Home: times_s[0], End: times_s[1] }[event.key];
      if (to_s === undefined) return;
      event.preventDefault();
      this.#to(Math.min(Math.max(to_s, times_s[0]), times_s[1]));
    });
  }

  /** @param {number} time_s */
  #to(time_s) {
    this.stop();
    this.#seek(time_s);
  }
}
