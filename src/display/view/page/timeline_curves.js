// @ts-check
// The timeline's curves: the planned clearance as a thin line, and the measured clearance over it.

import { line } from './timeline_axis.js';

/** @typedef {import('./levels.js').Levels} Levels */
/** @typedef {import('./palette.js').Palette} Palette */
/** @typedef {import('./plan_times.js').PlanTimes} PlanTimes */
/** @typedef {import('./show.js').Chart} Chart */
/** @typedef {import('./timeline_axis.js').Axis} Axis */

/** Half the width of a near miss's mark. */
const MARK_PX = 4;

/**
 * Draws the planned clearance, fainter after the contact, and a mark at each near miss.
 * @param {CanvasRenderingContext2D} context
 * @param {Axis} axis
 * @param {Levels} levels
 * @param {PlanTimes} times
 * @param {Palette} palette
 */
export function drawPlan(context, axis, levels, { curve, nearMisses, contact }, palette) {
  context.save();
  context.beginPath();
  context.rect(axis.left, axis.top, axis.right - axis.left, axis.bottom - axis.top);
  context.clip();
  context.lineWidth = 1.25;
  context.lineJoin = 'round';
  context.strokeStyle = palette.edge;
  const contact_s = contact?.time_s ?? Infinity;
  stroke(context, axis, levels, curve.filter((point) => point.time_s <= contact_s));
  context.globalAlpha = 0.35;
  stroke(context, axis, levels, curve.filter((point) => point.time_s >= contact_s));
  context.restore();
  for (const { time_s, clearance_m } of nearMisses) {
    if (time_s > axis.end_s) continue;
    const [x, y] = [axis.x(time_s), levels.y(clearance_m)];
    context.beginPath();
    context.moveTo(x - MARK_PX, y - 2 * MARK_PX);
    context.lineTo(x + MARK_PX, y - 2 * MARK_PX);
    context.lineTo(x, y - 1);
    context.closePath();
    context.fillStyle = palette.near;
    context.fill();
    context.lineWidth = 1;
    context.strokeStyle = palette.panel;
    context.stroke();
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Axis} axis
 * @param {Levels} levels
 * @param {readonly import('./plan_times.js').Point[]} points
 */
function stroke(context, axis, levels, points) {
  context.beginPath();
  for (const { time_s, clearance_m } of points) context.lineTo(axis.x(time_s), levels.y(clearance_m));
  context.stroke();
}

/**
 * Draws the least measured clearance of each part of the run, filled in the colour of its level.
 * @param {CanvasRenderingContext2D} context
 * @param {Axis} axis
 * @param {Levels} levels
 * @param {Chart} chart
 * @param {number} near_m
 * @param {Palette} palette
 */
export function drawMeasured(context, axis, levels, chart, near_m, palette) {
  const zero = levels.y(0);
  const wide = axis.x(axis.start_s + chart.step_s) - axis.x(axis.start_s);
  context.lineWidth = 2;
  let before = NaN;
  chart.least_m.forEach((least_m, bin) => {
    if (!Number.isNaN(least_m)) {
      const [x, y] = [axis.x(chart.start_s + bin * chart.step_s), levels.y(least_m)];
      const colour = least_m <= 0 ? palette['contact-fill'] : least_m <= near_m ? palette['near-fill'] : palette.accent;
      context.fillStyle = colour;
      context.globalAlpha = least_m <= near_m ? 0.45 : 0.16;
      const left = Math.round(x);
      context.fillRect(left, Math.min(y, zero), Math.round(x + wide) - left, Math.abs(zero - y));
      context.globalAlpha = 1;
      context.strokeStyle = colour;
      const isFirst = Number.isNaN(before);
      line(context, isFirst ? x : x - wide / 2, levels.y(isFirst ? least_m : before), x + wide / 2, y);
    }
    before = least_m;
  });
}
