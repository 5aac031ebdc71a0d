// @ts-check
// The show from its start to its end: the clearance so far, where it is now, what is ahead. A time is chosen by a press or
// with the arrow keys; to look at one changes nothing.

import { fineCanvas, font } from './canvas.js';
import { element, write } from './element.js';
import * as format from './format.js';
import { Levels } from './levels.js';

/** @typedef {import('./show.js').Show} Show */
/** @typedef {import('./show.js').Run} Run */
/** @typedef {import('./show.js').Chart} Chart */
/** @typedef {import('./palette.js').Palette} Palette */

const LEFT_PX = 34;
const RIGHT_PX = 14;
const TOP_PX = 22;
const BOTTOM_PX = 22;
/** Room for a flag beside its line. */
const FLAG_PX = 110;
const FLAG_ROW_PX = 17;
const TICKS = [1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 14400];
const TICK_PX = 64;

export class Timeline {
  #area = element('timeline-area', HTMLElement);
  #reading = element('timeline-reading', HTMLElement);
  #screen;
  /** @type {Palette} */ #palette;
  #width = 1;
  #height = 1;
  /** @type {Run | null} */ #run = null;
  /** @type {number | null} */ #chosen_s = null;
  /** @type {number | null} */ #pointed_s = null;

  /**
   * @param {Palette} palette
   * @param {(time_s: number) => void} chosen
   * @param {() => void} changed
   */
  constructor(palette, chosen, changed) {
    this.#palette = palette;
    this.#screen = fineCanvas(element('timeline', HTMLCanvasElement), (width, height) => {
      [this.#width, this.#height] = [width, height];
      changed();
    });
    const choose = (/** @type {number} */ time_s) => {
      if (this.#run === null) return;
      this.#chosen_s = Math.min(Math.max(time_s, this.#run.start_s), this.#run.end_s);
      chosen(this.#chosen_s);
      changed();
    };
    this.#area.addEventListener('click', (event) => choose(this.#timeAt(event.offsetX)));
    this.#area.addEventListener('pointermove', (event) => {
      this.#pointed_s = event.pointerType === 'mouse' ? this.#timeAt(event.offsetX) : null;
      changed();
    });
    this.#area.addEventListener('pointerleave', () => {
      this.#pointed_s = null;
      changed();
    });
    this.#area.addEventListener('keydown', (event) => {
      const time_s = this.#stepped(event.key);
      if (time_s === null || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      choose(time_s);
    });
  }

  focus() {
    this.#area.focus();
  }

  /** @param {Palette} palette */
  recolour(palette) {
    this.#palette = palette;
  }

  /** @param {Show} show */
  draw(show) {
    const run = show.runOfFrame() ?? show.run;
    if (run?.run_id !== this.#run?.run_id) this.#chosen_s = null;
    this.#run = run;
    this.#screen.begin();
    this.#screen.clear(this.#palette.panel);
    if (run === null) return;
    const levels = new Levels(show.chart, TOP_PX, this.#height - BOTTOM_PX);
    this.#drawLevels(levels, run);
    this.#drawTimes(run);
    if (show.chart !== null) this.#drawClearance(show.chart, levels, run);
    this.#drawNow(show);
    this.#drawEvents(show);
    this.#drawChosen();
    this.#writeReading(show, run);
  }

  /** @param {number} time_s */
  #x(time_s) {
    const { start_s, end_s } = /** @type {Run} */ (this.#run);
    return LEFT_PX + ((time_s - start_s) / (end_s - start_s)) * (this.#width - LEFT_PX - RIGHT_PX);
  }

  /** @param {number} x */
  #timeAt(x) {
    if (this.#run === null) return 0;
    const { start_s, end_s } = this.#run;
    const part = (x - LEFT_PX) / (this.#width - LEFT_PX - RIGHT_PX);
    return start_s + Math.min(Math.max(part, 0), 1) * (end_s - start_s);
  }

  /** Where a key moves the chosen time to. @param {string} key */
  #stepped(key) {
    if (this.#run === null) return null;
    const from_s = this.#chosen_s ?? Number(this.#area.dataset.nowS);
    const page_s = (this.#run.end_s - this.#run.start_s) / 10;
    switch (key) {
      case 'ArrowLeft':
      case 'ArrowDown':
        return Math.round(from_s) - 1;
      case 'ArrowRight':
      case 'ArrowUp':
        return Math.round(from_s) + 1;
      case 'PageDown':
        return from_s - page_s;
      case 'PageUp':
        return from_s + page_s;
      case 'Home':
        return this.#run.start_s;
      case 'End':
        return this.#run.end_s;
      default:
        return null;
    }
  }

  /** @param {Levels} levels @param {Run} run */
  #drawLevels(levels, run) {
    const { context } = this.#screen;
    context.font = font(500, 11);
    context.textAlign = 'right';
    context.textBaseline = 'middle';
    context.lineWidth = 1;
    for (const level_m of levels.lines_m()) {
      const y = Math.round(levels.y(level_m)) + 0.5;
      context.strokeStyle = level_m === 0 ? this.#palette.contact : this.#palette.rule;
      line(context, LEFT_PX, y, this.#width - RIGHT_PX, y);
      context.fillStyle = level_m === 0 ? this.#palette.contact : this.#palette.quiet;
      context.fillText(String(level_m * 1e3), LEFT_PX - 7, y);
    }
    context.setLineDash([5, 4]);
    context.strokeStyle = this.#palette.near;
    const near = Math.round(levels.y(run.near_m)) + 0.5;
    line(context, LEFT_PX, near, this.#width - RIGHT_PX, near);
    context.setLineDash([]);
  }

  /** @param {Run} run */
  #drawTimes({ start_s, end_s }) {
    const { context } = this.#screen;
    const least_s = ((end_s - start_s) * TICK_PX) / (this.#width - LEFT_PX - RIGHT_PX);
    const step_s = TICKS.find((tick_s) => tick_s >= least_s) ?? least_s;
    context.fillStyle = this.#palette.quiet;
    context.textBaseline = 'alphabetic';
    for (let time_s = Math.ceil(start_s / step_s) * step_s; time_s <= end_s; time_s += step_s) {
      const x = this.#x(time_s);
      context.textAlign = x < LEFT_PX + 10 ? 'left' : x > this.#width - RIGHT_PX - 14 ? 'right' : 'center';
      context.fillText(`${format.fixed(time_s, 0)}${time_s + step_s > end_s ? ' s' : ''}`, x, this.#height - 5);
    }
  }

  /**
   * The least clearance of each stretch, filled in the colour of its level.
   * @param {Chart} chart
   * @param {Levels} levels
   * @param {Run} run
   */
  #drawClearance(chart, levels, run) {
    const { context } = this.#screen;
    const zero = levels.y(0);
    const wide = this.#x(run.start_s + chart.step_s) - this.#x(run.start_s);
    context.lineWidth = 2;
    let before = NaN;
    chart.least_m.forEach((least_m, bin) => {
      if (!Number.isNaN(least_m)) {
        const [x, y] = [this.#x(chart.start_s + bin * chart.step_s), levels.y(least_m)];
        const colour =
          least_m <= 0 ? this.#palette.contact : least_m <= run.near_m ? this.#palette.near : this.#palette.accent;
        context.fillStyle = colour;
        context.globalAlpha = least_m <= run.near_m ? 0.45 : 0.16;
        const left = Math.round(x);
        context.fillRect(left, Math.min(y, zero), Math.round(x + wide) - left, Math.abs(zero - y));
        context.globalAlpha = 1;
        context.strokeStyle = colour;
        line(
          context,
          Number.isNaN(before) ? x : x - wide / 2,
          levels.y(Number.isNaN(before) ? least_m : before),
          x + wide / 2,
          y,
        );
      }
      before = least_m;
    });
  }

  /** What has happened, and the contact ahead. @param {Show} show */
  #drawEvents({ alerts, status, frame }) {
    const { context } = this.#screen;
    for (const { run_id, kind, time_s } of alerts) {
      if (run_id !== frame?.run_id) continue;
      const isGrave = kind === 'contact' || kind === 'held' || kind === 'fault';
      context.fillStyle = isGrave ? this.#palette.contact : kind === 'near' ? this.#palette.near : this.#palette.quiet;
      context.fillRect(this.#x(time_s) - 1, TOP_PX - 6, 2, isGrave ? 12 : 8);
    }
    if (status?.outlook.kind !== 'contact') return;
    const x = this.#x(status.outlook.time_s);
    context.strokeStyle = this.#palette.contact;
    context.lineWidth = 2;
    context.setLineDash([4, 3]);
    line(context, x, TOP_PX - 4, x, this.#height - BOTTOM_PX);
    context.setLineDash([]);
    // To the left where there is room before the flag of now, else under that one.
    const left_px = frame === null ? x : x - this.#x(frame.time_s);
    const isAtEnd = x > this.#width - FLAG_PX;
    const row = isAtEnd && left_px < FLAG_PX ? 1 : 0;
    this.#drawFlag(`contact ${format.fixed(status.outlook.time_s, 1)}`, x, this.#palette.contact, this.#palette.panel, {
      isLeft: isAtEnd,
      row,
    });
  }

  /** @param {Show} show */
  #drawNow({ frame }) {
    if (frame === null) return;
    this.#area.dataset.nowS = String(frame.time_s);
    const { context } = this.#screen;
    const x = this.#x(frame.time_s);
    context.strokeStyle = this.#palette.ink;
    context.lineWidth = 2;
    line(context, x, TOP_PX - 6, x, this.#height - BOTTOM_PX);
    this.#drawFlag(`now ${format.fixed(frame.time_s, 1)}`, x, this.#palette.ink, this.#palette.panel, {
      isLeft: x > FLAG_PX,
      row: 0,
    });
  }

  #drawChosen() {
    const { context } = this.#screen;
    for (const time_s of [this.#pointed_s, this.#chosen_s]) {
      if (time_s === null) continue;
      const x = this.#x(time_s);
      context.strokeStyle = this.#palette.pair;
      context.lineWidth = time_s === this.#chosen_s ? 2 : 1;
      line(context, x, TOP_PX, x, this.#height - BOTTOM_PX);
    }
    if (this.#chosen_s === null) return;
    const x = this.#x(this.#chosen_s);
    context.fillStyle = this.#palette.pair;
    context.beginPath();
    context.moveTo(x - 7, this.#height - BOTTOM_PX + 9);
    context.lineTo(x + 7, this.#height - BOTTOM_PX + 9);
    context.lineTo(x, this.#height - BOTTOM_PX - 1);
    context.fill();
  }

  /**
   * A small flag on a line, in the first or the second row, inside the picture.
   * @param {string} text
   * @param {number} x
   * @param {string} ground
   * @param {string} ink
   * @param {{isLeft: boolean, row: number}} place
   */
  #drawFlag(text, x, ground, ink, { isLeft, row }) {
    const { context } = this.#screen;
    context.font = font(650, 11);
    const wide = context.measureText(text).width + 12;
    const wished = isLeft ? x - wide + 1 : x - 1;
    const top = 1 + row * FLAG_ROW_PX;
    const left = Math.min(Math.max(wished, 2), this.#width - wide - 2);
    context.fillStyle = ground;
    context.beginPath();
    context.roundRect(left, top, wide, 16, 4);
    context.fill();
    context.fillStyle = ink;
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    context.fillText(text, left + wide / 2, top + 8.5);
  }

  /** @param {Show} show @param {Run} run */
  #writeReading({ chart, frame }, run) {
    const time_s = this.#pointed_s ?? this.#chosen_s ?? frame?.time_s ?? run.start_s;
    const least_m =
      chart === null
        ? NaN
        : chart.least_m[Math.min(Math.floor((time_s - chart.start_s) / chart.step_s), chart.least_m.length - 1)];
    const clearance = Number.isFinite(least_m) ? `least clearance ${format.millimetres(least_m)} mm` : 'not seen';
    const isChosen = this.#pointed_s !== null || this.#chosen_s !== null;
    write(this.#reading, isChosen ? `at ${format.fixed(time_s, 1)} s: ${clearance}` : '');
    const aria = {
      valuemin: run.start_s,
      valuemax: run.end_s,
      valuenow: time_s,
      valuetext: `${format.fixed(time_s, 1)} seconds, ${clearance}`,
    };
    // A slider that runs with the show would be read out without end: it is of the chosen time, or of the start.
    if (this.#chosen_s === null) Object.assign(aria, { valuenow: run.start_s, valuetext: 'no time chosen' });
    for (const [name, value] of Object.entries(aria)) this.#area.setAttribute(`aria-${name}`, String(value));
  }
}

/** @param {CanvasRenderingContext2D} context @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 */
function line(context, x0, y0, x1, y1) {
  context.beginPath();
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
  context.stroke();
}
