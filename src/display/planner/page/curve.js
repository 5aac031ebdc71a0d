// @ts-check
// The clearance over plan time, with the contact, near misses, and a cursor to drag. An outdated curve is grey.

import { fineCanvas, font } from './canvas.js';
import { fixed } from './format.js';
import { Levels } from './levels.js';
import { Axis, line } from './timeline_axis.js';

/** @typedef {import('./palette.js').Palette} Palette */
/** @typedef {import('./plan_message.js').PlanMessage} PlanMessage */
/** @typedef {import('./plan_message.js').Contact} Contact */
/** @typedef {import('./plan_message.js').Miss} Miss */
/** @typedef {{time_s: number, clearance_m: number}} Sample */
/**
 * @typedef {object} Picture
 * @property {PlanMessage} plan
 * @property {Contact} contact
 * @property {Sample[]} samples
 * @property {boolean} isOld whether the samples are those of an earlier plan
 * @property {Miss[]} misses
 * @property {number} time_s the cursor's
 */

/** Height of the part above the curves, in which times are written. */
const TOP_PX = 22;

export class Curve {
  #screen;
  #size = [1, 1];
  /** @type {Palette} */ palette;

  /** @param {HTMLCanvasElement} canvas @param {Palette} palette @param {() => void} changed */
  constructor(canvas, palette, changed) {
    this.palette = palette;
    this.#screen = fineCanvas(canvas, (width, height) => {
      this.#size = [width, height];
      changed();
    });
  }

  /** The time at a place, as far as the plan goes. @param {PlanMessage} plan @param {number} x */
  timeAt(plan, x) {
    return this.#axis(plan).timeAt(x);
  }

  /** @param {PlanMessage} plan */
  #axis({ times_s: [start_s, end_s] }) {
    const axis = new Axis(start_s, Math.max(end_s, start_s + 1e-3), this.#size[0], this.#size[1]);
    axis.top = TOP_PX;
    return axis;
  }

  /** @param {Picture} picture */
  draw({ plan, contact, samples, isOld, misses, time_s }) {
    const { context } = this.#screen;
    const palette = this.palette;
    const near_m = plan.run.near_m;
    const axis = this.#axis(plan);
    const levels = new Levels(null, /** @type {import('./plan_times.js').Point[]} */ (/** @type {unknown} */ (samples)), axis.top, axis.bottom);
    this.#screen.clear(palette.panel);
    this.#screen.begin();
    axis.drawLevels(context, levels, near_m, palette);
    axis.drawTimes(context, palette, 'plan time');
    context.lineWidth = 2;
    context.lineJoin = 'round';
    context.strokeStyle = isOld ? palette.edge : palette.accent;
    context.beginPath();
    for (const sample of samples) context.lineTo(axis.x(sample.time_s), levels.y(sample.clearance_m));
    context.stroke();
    for (const miss of misses) this.#mark(axis.x(miss.time_s), levels.y(miss.clearance_m), palette.near);
    if (contact.time_s !== undefined) this.#flag(axis, contact.time_s, palette.contact, `contact ${fixed(contact.time_s, 2)}`);
    context.strokeStyle = palette.ink;
    const x = axis.x(time_s);
    context.lineWidth = 2;
    line(context, x, axis.top - 6, x, axis.bottom);
    context.beginPath();
    context.arc(x, axis.top - 8, 6, 0, 2 * Math.PI);
    context.fillStyle = palette.ink;
    context.fill();
  }

  /** @param {number} x @param {number} y @param {string} colour */
  #mark(x, y, colour) {
    const { context } = this.#screen;
    context.beginPath();
    context.moveTo(x - 4, y - 8);
    context.lineTo(x + 4, y - 8);
    context.lineTo(x, y - 1);
    context.closePath();
    context.fillStyle = colour;
    context.fill();
  }

  /** @param {Axis} axis @param {number} time_s @param {string} colour @param {string} text */
  #flag(axis, time_s, colour, text) {
    const { context } = this.#screen;
    const x = axis.x(time_s);
    context.strokeStyle = colour;
    context.lineWidth = 2;
    line(context, x, axis.top - 4, x, axis.bottom);
    context.font = font(600, 13);
    context.fillStyle = colour;
    context.textBaseline = 'alphabetic';
    const isRight = x > (axis.left + axis.right) / 2;
    context.textAlign = isRight ? 'right' : 'left';
    context.fillText(text, x + (isRight ? -12 : 12), axis.top - 5);
  }
}
