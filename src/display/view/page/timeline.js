// @ts-check
// The timeline of the show: the planned clearance, the measured clearance over it, the current show time and the forecast.
// A press or the arrow keys choose a time. Choosing a time sends nothing.

import { severityOf } from './alert_filter.js';
import { fineCanvas, font } from './canvas.js';
import { element, write } from './element.js';
import { placeFlags } from './flags.js';
import * as format from './format.js';
import { Levels } from './levels.js';
import { NO_PLAN, planInWords, planOverTime, plannedAt, timesOfFormation } from './plan_times.js';
import { Axis, line } from './timeline_axis.js';
import { drawMeasured, drawPlan } from './timeline_curves.js';

/** @typedef {import('./show.js').Show} Show */
/** @typedef {import('./show.js').Run} Run */
/** @typedef {import('./palette.js').Palette} Palette */
/** @typedef {import('./plan_times.js').PlanTimes} PlanTimes */

const FLAG_ROWS = 2;
const FLAG_ROW_PX = 20;
const FLAG_HIGH_PX = 18;
/** Distance in pixels up to which a time counts as that of a mark. */
const MARK_REACH_PX = 5;

export class Timeline {
  #area = element('timeline-area', HTMLElement);
  #reading = element('timeline-reading', HTMLElement);
  #screen;
  /** @type {Palette} */ #palette;
  #width = 1;
  #height = 1;
  /** @type {Run | null} */ #run = null;
  #axis = new Axis(0, 1, 1, 1);
  /** The plan over show time. */
  times = NO_PLAN;
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
    this.#area.addEventListener('click', (event) => choose(this.#axis.timeAt(event.offsetX)));
    this.#area.addEventListener('pointermove', (event) => {
      this.#pointed_s = event.pointerType === 'mouse' ? this.#axis.timeAt(event.offsetX) : null;
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
    const { plan, chart, status } = show;
    const clock = status?.clock ?? null;
    this.times = timesOf(plan, clock, run);
    // A head that walks slower than planned still walks after the planned end.
    const end_s = Math.max(run.end_s, this.times.end_s ?? this.times.curve.at(-1)?.time_s ?? run.end_s);
    this.#axis = new Axis(run.start_s, end_s, this.#width, this.#height);
    const { context } = this.#screen;
    const levels = new Levels(chart, this.times.curve, this.#axis.top, this.#axis.bottom);
    this.#axis.drawLevels(context, levels, run.near_m, this.#palette);
    this.#axis.drawTimes(context, this.#palette);
    drawPlan(context, this.#axis, levels, this.times, this.#palette);
    if (chart !== null) drawMeasured(context, this.#axis, levels, chart, run.near_m, this.#palette);
    this.#drawAlerts(show);
    this.#drawFlags(show);
    this.#drawChosen();
    this.#writeReading(show, run);
    this.#area.dataset.nowS = String(show.frame?.time_s ?? run.start_s);
    this.#area.dataset.levels = JSON.stringify(this.#axis.levels_px);
    this.#area.dataset.measured = String(chart === null ? 0 : chart.least_m.filter(Number.isFinite).length);
    this.#area.dataset.plannedPoints = String(this.times.curve.length);
  }

  /** The chosen time after a key; `null` for other keys. @param {string} key */
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

  /** Draws the alerts of this run. @param {Show} show */
  #drawAlerts({ alerts, frame }) {
    const { context } = this.#screen;
    for (const { run_id, kind, time_s } of alerts) {
      if (run_id !== frame?.run_id) continue;
      const severity = severityOf(kind);
      const { contact: danger, near: caution, quiet: calm } = this.#palette;
      context.fillStyle = { danger, caution, calm }[severity];
      context.fillRect(this.#axis.x(time_s) - 1, this.#axis.top - 4, 2, severity === 'danger' ? 12 : 8);
    }
  }

  /** Draws the flags of now, the stop, the contact, and the nearest near misses if they have room. @param {Show} show */
  #drawFlags({ frame, status }) {
    const { contact: ink, near, panel } = this.#palette;
    const flags = [];
    if (frame !== null) {
      const text = `now ${format.fixed(frame.time_s, 1)}`;
      flags.push({ time_s: Math.min(frame.time_s, this.#axis.end_s), text, ground: this.#palette.ink, dash: [], isNeeded: true });
    }
    const outlook = status?.outlook ?? /** @type {const} */ ({ kind: 'unknown' });
    // The head's stop takes precedence over a contact that the head does not reach.
    const willStand = outlook.kind === 'guard_stop' || outlook.kind === 'rest';
    if (willStand) {
      const text = `${outlook.kind === 'rest' ? 'stop' : 'guard stop'} ${format.fixed(outlook.time_s, 1)}`;
      flags.push({ time_s: outlook.time_s, text, ground: this.#palette.pair, dash: [6, 2], isNeeded: true });
    }
    const contact_s = this.times.contact?.time_s ?? (outlook.kind === 'contact' ? outlook.time_s : null);
    if (contact_s !== null) {
      const text = `contact ${format.fixed(contact_s, 1)}`;
      flags.push({ time_s: contact_s, text, ground: ink, dash: [4, 3], isNeeded: !willStand });
    }
    for (const { time_s, clearance_m } of this.times.nearMisses.toSorted((a, b) => a.clearance_m - b.clearance_m)) {
      flags.push({ time_s, text: `${format.millimetres(clearance_m)} mm`, ground: near, dash: [1, 3], isNeeded: false });
    }
    const { context } = this.#screen;
    context.font = font(650, 13);
    const placed = flags
      .filter(({ time_s }) => time_s <= this.#axis.end_s)
      .map((flag) => ({ ...flag, x: this.#axis.x(flag.time_s), wide: context.measureText(flag.text).width + 12 }));
    const places = placeFlags(placed, this.#width, FLAG_ROWS);
    const lines = placed.map((flag, at) => ({ ...flag, place: places[at] })).filter(({ place }) => place !== null);
    for (const { x, ground, dash, place } of lines.toReversed()) {
      context.strokeStyle = ground;
      context.lineWidth = dash.length === 2 && dash[0] === 1 ? 1 : 2;
      context.setLineDash(dash);
      line(context, x, 1 + (place?.row ?? 0) * FLAG_ROW_PX + FLAG_HIGH_PX, x, this.#axis.bottom);
    }
    context.setLineDash([]);
    for (const { text, ground, wide, place } of lines) {
      if (place !== null) this.#drawFlag(text, wide, place, ground, panel);
    }
    this.#area.dataset.flags = JSON.stringify(
      lines.map(({ text, wide, place }) => ({ text, left: place?.left, row: place?.row, wide })),
    );
  }

  /**
   * @param {string} text
   * @param {number} wide
   * @param {import('./flags.js').Place} place
   * @param {string} ground
   * @param {string} ink
   */
  #drawFlag(text, wide, { left, row }, ground, ink) {
    const { context } = this.#screen;
    const top = 1 + row * FLAG_ROW_PX;
    context.fillStyle = ground;
    context.beginPath();
    context.roundRect(left, top, wide, FLAG_HIGH_PX, 4);
    context.fill();
    context.fillStyle = ink;
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    context.fillText(text, left + wide / 2, top + FLAG_HIGH_PX / 2 + 0.5);
  }

  #drawChosen() {
    const { context } = this.#screen;
    const { top, bottom } = this.#axis;
    for (const time_s of [this.#pointed_s, this.#chosen_s]) {
      if (time_s === null) continue;
      const x = this.#axis.x(time_s);
      context.strokeStyle = this.#palette.pair;
      context.lineWidth = time_s === this.#chosen_s ? 2 : 1;
      line(context, x, top, x, bottom);
    }
    if (this.#chosen_s === null) return;
    const x = this.#axis.x(this.#chosen_s);
    context.fillStyle = this.#palette.pair;
    context.beginPath();
    context.moveTo(x - 7, bottom + 9);
    context.lineTo(x + 7, bottom + 9);
    context.lineTo(x, bottom - 1);
    context.fill();
  }

  /** @param {Show} show @param {Run} run */
  #writeReading({ chart, plan, frame }, run) {
    const time_s = this.#pointed_s ?? this.#chosen_s;
    const summary = plan === null ? '' : planInWords(plan, this.times, frame?.state === 'ended', format);
    const reading = time_s === null ? summary : this.#readingAt(time_s, chart);
    write(this.#reading, reading);
    // A screen reader would announce a slider that moves with the show without end. So its value is the chosen time, or the
    // start.
    const [valuenow, valuetext] =
      this.#chosen_s === null
        ? [run.start_s, `no time chosen. ${summary}`]
        : [this.#chosen_s, this.#readingAt(this.#chosen_s, chart)];
    const aria = { valuemin: run.start_s, valuemax: run.end_s, valuenow, valuetext };
    for (const [name, value] of Object.entries(aria)) this.#area.setAttribute(`aria-${name}`, String(value));
  }

  /** The clearances at a time in words; near a mark, the mark's event. @param {number} time_s @param {Show['chart']} chart */
  #readingAt(time_s, chart) {
    const isAt = (/** @type {{time_s: number}} */ mark) =>
      Math.abs(this.#axis.x(mark.time_s) - this.#axis.x(time_s)) <= MARK_REACH_PX;
    const { contact, nearMisses, curve } = this.times;
    const at = (/** @type {number} */ mark_s, /** @type {number} */ digits) =>
      `at ${format.fixed(mark_s, digits)} s (${format.minutes(mark_s)})`;
    if (contact !== null && isAt(contact))
      return `${at(contact.time_s, 3)}: planned contact, ${format.pair(contact)}`;
    const nearest = nearMisses.filter(isAt).sort((a, b) => a.clearance_m - b.clearance_m)[0];
    if (nearest !== undefined) {
      return `${at(nearest.time_s, 3)}: near miss ${format.millimetres(nearest.clearance_m)} mm, ${format.pair(nearest)}`;
    }
    const bin = chart === null ? -1 : Math.floor((time_s - chart.start_s) / chart.step_s);
    const measured_m = chart?.least_m[Math.min(bin, chart.least_m.length - 1)] ?? NaN;
    const planned_m = plannedAt(curve, time_s);
    const words = [];
    if (Number.isFinite(measured_m)) words.push(`measured minimum ${format.millimetres(measured_m)} mm`);
    if (Number.isFinite(planned_m)) words.push(`planned ${format.millimetres(planned_m)} mm`);
    return `${at(time_s, 1)}: ${words.join(', ') || 'unknown'}`;
  }
}

/** The plan over show time. @param {Show['plan']} plan @param {import('./plan_times.js').Clock | null} clock @param {Run} run */
function timesOf(plan, clock, run) {
  if (clock === null) return NO_PLAN;
  if (run.dragons !== undefined) return timesOfFormation(plan, clock, run);
  return plan === null ? NO_PLAN : planOverTime(plan, clock, run);
}
