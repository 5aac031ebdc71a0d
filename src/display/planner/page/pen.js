// @ts-check
// A pen: points that are pressed one after the other, on the drawing or by keys. For routes, borders, measures and pictures.

import { font } from './canvas.js';
import { element, write } from './element.js';
import { fixed } from './format.js';

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./palette.js').Palette} Palette */
/** @typedef {[number, number]} Place in metres */
/** @typedef {{words: string, least: number, most?: number, isClosed?: boolean, done: ((points: Place[]) => void) | null}} Job */

/** Points nearer than this to the last one end the drawing, in pixels. */
const SAME_PX = 6;
/** Metres of an arrow key without a snap. */
const STEP_M = 0.5;

const bar = element('pen-bar', HTMLDivElement);
const tools = element('tools', HTMLDivElement);
const done = element('pen-done', HTMLButtonElement);

export class Pen {
  /** @type {Job | null} */ #job = null;
  /** @type {Place[]} */ #points = [];
  /** @type {Place | null} */ #cursor = null;
  #camera;
  #changed;

  /** @param {Camera} camera @param {() => void} changed */
  constructor(camera, changed) {
    this.#camera = camera;
    this.#changed = changed;
    done.addEventListener('click', () => this.finish());
    element('pen-back', HTMLButtonElement).addEventListener('click', () => this.back());
    element('pen-cancel', HTMLButtonElement).addEventListener('click', () => this.leave());
  }

  get isActive() {
    return this.#job !== null;
  }

  /** @param {Job} job */
  start(job) {
    this.#job = job;
    this.#points = [];
    this.#cursor = null;
    this.show();
  }

  leave() {
    this.#job = null;
    this.show();
  }

  back() {
    this.#points.pop();
    this.show();
  }

  /** @param {Place} place */
  hover(place) {
    this.#cursor = place;
    this.#changed();
  }

  /** Adds a point; a second press at the last one ends the drawing. @param {Place} place */
  add(place) {
    const last = this.#points.at(-1);
    if (last !== undefined && Math.hypot(place[0] - last[0], place[1] - last[1]) * this.#camera.scale < SAME_PX) return this.finish();
    this.#points.push(place);
    this.#cursor = place;
    if (this.#points.length === this.#job?.most) return this.finish();
    this.show();
  }

  finish() {
    const job = this.#job;
    if (job === null || this.#points.length < job.least) return;
    if (job.done === null) this.#points = [];
    else this.#job = null;
    this.show();
    job.done?.(this.#points);
  }

  /** A key while the pen is in use. Returns whether it was one of the pen's. @param {KeyboardEvent} event @param {number} snap_m */
  key({ key, shiftKey }, snap_m) {
    const step = (snap_m > 0 ? snap_m : STEP_M) * (shiftKey ? 10 : 1);
    const [x, y] = this.#cursor ?? [Math.round(this.#camera.x), Math.round(this.#camera.y)];
    const to = { ArrowLeft: [x - step, y], ArrowRight: [x + step, y], ArrowUp: [x, y + step], ArrowDown: [x, y - step] }[key];
    if (to !== undefined) this.hover(/** @type {Place} */ (to));
    else if (key === 'Enter') this.add([x, y]);
    else if (key === 'Backspace' || key === 'Delete') this.back();
    else if (key === 'Escape') this.leave();
    else return false;
    this.show();
    return true;
  }

  show() {
    bar.hidden = this.#job === null;
    tools.hidden = !bar.hidden;
    if (this.#job !== null) {
      const place = this.#cursor === null ? '' : ` At (${fixed(this.#cursor[0], 2)}, ${fixed(this.#cursor[1], 2)}).`;
      const length = this.#points.length > 1 ? ` ${fixed(this.#length_m(), 3)} m.` : '';
      write(element('pen-words', HTMLElement), `${this.#job.words}${length}${place}`);
      done.disabled = this.#points.length < this.#job.least;
      done.hidden = this.#job.done === null;
      element('pen-back', HTMLButtonElement).disabled = this.#points.length === 0;
    }
    this.#changed();
  }

  #length_m() {
    return this.#points.slice(1).reduce((sum, [x, y], at) => sum + Math.hypot(x - this.#points[at][0], y - this.#points[at][1]), 0);
  }

  /** @param {CanvasRenderingContext2D} context @param {Palette} palette */
  draw(context, palette) {
    if (this.#job === null) return;
    const all = this.#cursor === null ? this.#points : [...this.#points, this.#cursor];
    const places = all.map(([x, y]) => this.#camera.toScreen(x, y));
    context.save();
    context.strokeStyle = palette.accent;
    context.fillStyle = palette.accent;
    context.lineWidth = 2;
    context.beginPath();
    for (const [x, y] of places) context.lineTo(x, y);
    if (this.#job.isClosed && places.length > 2) context.closePath();
    context.stroke();
    for (const [x, y] of places) context.fillRect(x - 3, y - 3, 6, 6);
    context.font = font(600, 14);
    context.textAlign = 'center';
    context.lineWidth = 4;
    context.strokeStyle = palette.halo;
    context.fillStyle = palette.ink;
    for (let at = 1; at < all.length; at += 1) {
      const text = `${fixed(Math.hypot(all[at][0] - all[at - 1][0], all[at][1] - all[at - 1][1]), 2)} m`;
      const [x, y] = [(places[at][0] + places[at - 1][0]) / 2, (places[at][1] + places[at - 1][1]) / 2 - 8];
      context.strokeText(text, x, y);
      context.fillText(text, x, y);
    }
    context.restore();
  }
}
