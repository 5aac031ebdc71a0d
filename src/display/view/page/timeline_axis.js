// @ts-check
// The timeline's axes: show time from left to right, clearance from top to bottom.

import { font } from './canvas.js';
import * as format from './format.js';

/** @typedef {import('./levels.js').Levels} Levels */
/** @typedef {import('./palette.js').Palette} Palette */

export const LEFT_PX = 46;
export const RIGHT_PX = 14;
export const TOP_PX = 44;
export const BOTTOM_PX = 24;
/** Least distance between the texts of two levels. */
const LEVEL_PX = 15;
const TICKS = [1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 14400];
const TICK_PX = 64;
/** Length of the show, in seconds, from which on times are in minutes and seconds. */
const LONG_S = 1200;

export class Axis {
  /**
   * @param {number} start_s
   * @param {number} end_s
   * @param {number} width
   * @param {number} height
   */
  constructor(start_s, end_s, width, height) {
    this.start_s = start_s;
    this.end_s = end_s;
    this.width = width;
    this.height = height;
    this.top = TOP_PX;
    this.bottom = height - BOTTOM_PX;
    this.left = LEFT_PX;
    this.right = width - RIGHT_PX;
    /** Heights of the texts at the left. @type {number[]} */
    this.levels_px = [];
  }

  /** @param {number} time_s */
  x(time_s) {
    return this.left + ((time_s - this.start_s) / (this.end_s - this.start_s)) * (this.right - this.left);
  }

  /** @param {number} x */
  timeAt(x) {
    const part = (x - this.left) / (this.right - this.left);
    return this.start_s + Math.min(Math.max(part, 0), 1) * (this.end_s - this.start_s);
  }

  /**
   * Draws the lines of clearances, in millimetres, and the line at and below which pairs are near.
   * @param {CanvasRenderingContext2D} context
   * @param {Levels} levels
   * @param {number} near_m
   * @param {Palette} palette
   */
  drawLevels(context, levels, near_m, palette) {
    context.font = font(500, 13);
    context.textAlign = 'right';
    context.textBaseline = 'middle';
    context.lineWidth = 1;
    const caption_px = this.top - 15;
    context.fillStyle = palette.quiet;
    context.fillText('mm', this.left - 7, caption_px);
    const taken = [caption_px];
    // The lowest level is the most important one. A level without room for its text has no line.
    for (const level_m of levels.lines_m().toReversed()) {
      const y = Math.round(levels.y(level_m)) + 0.5;
      if (taken.some((other) => Math.abs(other - y) < LEVEL_PX)) continue;
      taken.push(y);
      context.strokeStyle = level_m === 0 ? palette.contact : palette.rule;
      line(context, this.left, y, this.right, y);
      context.fillStyle = level_m === 0 ? palette.contact : palette.quiet;
      context.fillText(String(level_m * 1e3), this.left - 7, y);
    }
    this.levels_px = taken;
    context.setLineDash([5, 4]);
    context.strokeStyle = palette.near;
    const near = Math.round(levels.y(near_m)) + 0.5;
    line(context, this.left, near, this.right, near);
    context.setLineDash([]);
  }

  /**
   * Draws the times at the bottom, and their caption.
   * @param {CanvasRenderingContext2D} context
   * @param {Palette} palette
   * @param {string} [what] the kind of time
   */
  drawTimes(context, palette, what = 'show time') {
    const length_s = this.end_s - this.start_s;
    const least_s = (length_s * TICK_PX) / (this.right - this.left);
    const step_s = TICKS.find((tick_s) => tick_s >= least_s) ?? least_s;
    const isLong = length_s >= LONG_S;
    const y = this.height - 5;
    context.font = font(500, 13);
    context.fillStyle = palette.quiet;
    context.textBaseline = 'alphabetic';
    context.textAlign = 'right';
    const caption = `${what}, ${isLong ? 'min:s' : 's'}`;
    context.fillText(caption, this.right, y);
    const free = this.right - context.measureText(caption).width - 10;
    for (let time_s = Math.ceil(this.start_s / step_s) * step_s; time_s <= this.end_s; time_s += step_s) {
      const x = this.x(time_s);
      const text = isLong ? format.minutes(time_s) : format.fixed(time_s, 0);
      const half = context.measureText(text).width / 2;
      context.textAlign = x < this.left + half ? 'left' : 'center';
      if (x + half < free) context.fillText(text, x, y);
    }
  }
}

/** @param {CanvasRenderingContext2D} context @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 */
export function line(context, x0, y0, x1, y1) {
  context.beginPath();
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
  context.stroke();
}
