// @ts-check
// A dragon as paths, in metres. Parts out of view are left out.

import { addOutline, board } from './boards.js';

/** @typedef {import('./show.js').Run} Run */
/** @typedef {import('./frame.js').Frame} Frame */
/** @typedef {import('./frame.js').DragonMotion} DragonMotion */
/** @typedef {import('./camera.js').Camera} Camera */

/** Boards per path: the cost of filling a path grows faster than its length. */
const BOARDS_A_PATH = 16;
/** Links per line. */
const LINKS_A_PATH = 64;
const HINGE_RADIUS_M = 0.028;
/** Approximate distance of a line's points, in pixels. Hinges between them are left out. */
const STRETCH_PX = 6;

/**
 * The box to show: the run's view, which contains the route and the stage. Without a run, or with a head outside that view: the
 * box around the dragon.
 * @param {Frame} frame
 * @param {Run | null} run
 */
export function extent({ handles }, run) {
  if (run !== null) {
    const [x0, y0, x1, y1] = run.view;
    const [x, y] = handles;
    if (x > x0 - 1 && x < x1 + 1 && y > y0 - 1 && y < y1 + 1) return { x0, y0, x1, y1 };
  }
  const box = { x0: Infinity, y0: Infinity, x1: -Infinity, y1: -Infinity };
  for (let at = 0; at + 1 < handles.length; at += 3) {
    box.x0 = Math.min(box.x0, handles[at]);
    box.x1 = Math.max(box.x1, handles[at]);
    box.y0 = Math.min(box.y0, handles[at + 1]);
    box.y1 = Math.max(box.y1, handles[at + 1]);
  }
  return box;
}

/** A line through every `step`th handle and the last one. @param {Float32Array} handles @param {number} step */
function polyline(handles, step) {
  const path = new Path2D();
  const last = handles.length - 3;
  for (let at = 0; at < last; at += step * 3) path.lineTo(handles[at], handles[at + 1]);
  path.lineTo(handles[last], handles[last + 1]);
  return path;
}

/**
 * A dragon as lines, one for each part in view, with a point every few pixels.
 * @param {Frame} frame
 * @param {DragonMotion} dragon
 * @param {Camera} camera
 */
export function* lines(frame, { first_handle, benches }, camera) {
  const handles = frame.handles.subarray(first_handle * 3, (first_handle + benches + 1) * 3);
  // All links but the first have the length of the last one.
  const end = handles.subarray(-6);
  const link_px = Math.hypot(end[0] - end[3], end[1] - end[4]) * camera.scale;
  const step = Math.max(Math.round(STRETCH_PX / link_px), 1);
  for (let first = 0; first < benches; first += LINKS_A_PATH * step) {
    const last = Math.min(first + LINKS_A_PATH * step, benches);
    const part = handles.subarray(first * 3, (last + 1) * 3);
    if (isSeen(part, camera, 0)) yield polyline(part, step);
  }
}

/**
 * The boards of a dragon in view, and their hinges.
 * @param {Frame} frame
 * @param {DragonMotion} dragon
 * @param {Run | null} run
 * @param {Camera} camera
 * @param {boolean} withHinges
 */
export function outlines(frame, { first_bench, first_handle, benches }, run, camera, withHinges) {
  /** @type {Path2D[]} */ const body = [];
  const hinges = new Path2D();
  for (let first = 0; first < benches; first += BOARDS_A_PATH) {
    const last = Math.min(first + BOARDS_A_PATH, benches);
    const part = frame.handles.subarray((first_handle + first) * 3, (first_handle + last + 1) * 3);
    if (!isSeen(part, camera, 2)) continue;
    const path = new Path2D();
    for (let index = first; index < last; index += 1) {
      addOutline(path, board(frame, run, first_bench + index));
      if (withHinges) {
        const at = (first_handle + index) * 3;
        const [x, y] = [frame.handles[at], frame.handles[at + 1]];
        hinges.moveTo(x + HINGE_RADIUS_M, y);
        hinges.arc(x, y, HINGE_RADIUS_M, 0, 2 * Math.PI);
      }
    }
    body.push(path);
  }
  return { body, hinges };
}

/** @param {Float32Array} handles @param {Camera} camera @param {number} around_m */
function isSeen(handles, camera, around_m) {
  const seen = camera.seen(around_m);
  let [left, right, below, above] = [true, true, true, true];
  for (let at = 0; at < handles.length; at += 3) {
    const [x, y] = [handles[at], handles[at + 1]];
    left &&= x < seen.x0;
    right &&= x > seen.x1;
    below &&= y < seen.y0;
    above &&= y > seen.y1;
  }
  return !(left || right || below || above);
}
