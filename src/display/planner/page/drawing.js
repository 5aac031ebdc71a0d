// @ts-check
// The drawing: route and dragons as on the page of a show, with the handles and the contact over them.

import { font } from './canvas.js';
import { Plan } from './plan.js';
import { drawGrid } from './snap.js';

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./palette.js').Palette} Palette */
/** @typedef {import('./plan_message.js').Handle} Handle */
/** @typedef {import('./plan_message.js').HandleId} HandleId */
/** @typedef {import('./plan_message.js').PlanMessage} PlanMessage */
/** @typedef {import('./plan_message.js').Pose} Pose */
/** @typedef {import('./plan_message.js').Contact} Contact */
/** @typedef {import('./show.js').Run} Run */

/** @typedef {{dragon: number, chosen: HandleId | null}} Choice the dragon whose route is drawn, and the chosen handle */

/** Sizes in pixels: radius of a handle, of a small one, reach of a mouse and of a finger. */
const [HANDLE_PX, SMALL_PX, MOUSE_PX, FINGER_PX] = [7, 5, 11, 24];
/** Least distance of the ends of a line, in pixels, from which on the handle in its middle is offered. */
const ROOM_PX = 56;
/** Handles of dragons that are not chosen. */
const ALWAYS = ['start', 'whole'];

/** Whether a handle is the middle of a line or of a side, where nothing is yet. @param {HandleId} handle */
export const isMiddle = ({ kind }) => kind.endsWith('middle');

/** Whether a handle belongs to a border of the stage. @param {HandleId} handle */
export const isOfBorder = ({ kind }) => /^(outline|keep_out|crowd)/.test(kind);

/** @param {HandleId} one @param {HandleId | null} other */
export const isSame = (one, other) =>
  other !== null && one.dragon === other.dragon && one.kind === other.kind && one.at === other.at && one.point === other.point;

export class Drawing {
  #plan;
  #context;
  #camera;
  #palette;

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {Camera} camera
   * @param {Palette} palette
   * @param {() => void} changed
   */
  constructor(canvas, camera, palette, changed) {
    this.#plan = new Plan(canvas, camera, palette, changed);
    this.#context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    this.#camera = camera;
    this.#palette = palette;
  }

  /** What lies under the route. @param {import('./route_layer.js').Underlay | null} underlay */
  set underlay(underlay) {
    this.#plan.underlay = underlay;
  }

  /** @param {Palette} palette */
  recolour(palette) {
    this.#palette = palette;
    this.#plan.recolour(palette);
  }

  /**
   * @param {PlanMessage} plan
   * @param {Pose} pose
   * @param {Contact} contact
   * @param {Choice} choice
   * @param {(context: CanvasRenderingContext2D) => void} over draws over the route and under the handles
   */
  draw(plan, pose, contact, choice, over) {
    const show = { frame: frameOf(plan.run, pose), runOfFrame: () => plan.run };
    this.#plan.draw(/** @type {import('./show.js').Show} */ (/** @type {unknown} */ (show)), null);
    drawGrid(this.#context, this.#camera, this.#palette.rule);
    this.#drawBorders(plan.run);
    over(this.#context);
    const { chosen } = choice;
    const handles = this.#offered(plan, choice);
    this.#drawFrames(handles);
    this.#drawContact(contact);
    for (const handle of handles) this.#drawHandle(handle, isSame(handle, chosen));
  }

  /**
   * The handle at a place; `null` without one. Corners are preferred to the middles of lines.
   * @param {PlanMessage} plan
   * @param {Choice} choice
   * @param {{x: number, y: number}} place
   * @param {boolean} isTouch
   */
  handleAt(plan, choice, { x, y }, isTouch) {
    const reach = isTouch ? FINGER_PX : MOUSE_PX;
    /** @type {Handle | null} */ let found = null;
    let least = Infinity;
    for (const handle of this.#offered(plan, choice)) {
      const [hx, hy] = this.#camera.toScreen(handle.x_m, handle.y_m);
      const distance = Math.hypot(hx - x, hy - y);
      if (distance > reach) continue;
      const cost = distance + (isMiddle(handle) ? reach : 0);
      if (cost < least) [found, least] = [handle, cost];
    }
    return found;
  }

  /** The handles that are shown: of several dragons, all of the chosen one, and the others' beginnings. @param {PlanMessage} plan @param {Choice} choice */
  #offered(plan, choice) {
    const isOwn = (/** @type {Handle} */ handle) =>
      plan.routes.length === 1 || handle.dragon === choice.dragon || ALWAYS.includes(handle.kind) || isOfBorder(handle);
    const own = plan.handles.filter(isOwn);
    return own.filter((handle) => !isMiddle(handle) || this.#hasRoom(own, handle));
  }

  /** A short line has no room for a new corner. @param {Handle[]} handles @param {Handle} handle */
  #hasRoom(handles, handle) {
    const [x, y] = this.#camera.toScreen(handle.x_m, handle.y_m);
    return handles.every((other) => {
      if (isMiddle(other) || other.dragon !== handle.dragon || isOfBorder(other) !== isOfBorder(handle)) return true;
      const [ox, oy] = this.#camera.toScreen(other.x_m, other.y_m);
      return Math.hypot(ox - x, oy - y) > ROOM_PX / 2;
    });
  }

  /** Draws the areas to keep out of and the line of the crowd once more, over the boards that would hide them. @param {Run} run */
  #drawBorders({ keep_out: areas, crowd }) {
    const context = this.#context;
    context.lineJoin = 'round';
    for (const [width, colour] of /** @type {const} */ ([[5, this.#palette.halo], [2, this.#palette.edge]])) {
      Object.assign(context, { lineWidth: width, strokeStyle: colour });
      for (const corners of areas) this.#stroke(corners, true);
      this.#stroke(crowd, false);
    }
  }

  /** @param {number[]} points x, y, … @param {boolean} isClosed */
  #stroke(points, isClosed) {
    const context = this.#context;
    context.beginPath();
    for (let at = 0; at + 1 < points.length; at += 2) context.lineTo(...this.#camera.toScreen(points[at], points[at + 1]));
    if (isClosed) context.closePath();
    context.stroke();
  }

  /** Draws the lines between corners, which the route rounds. @param {Handle[]} handles */
  #drawFrames(handles) {
    const context = this.#context;
    context.save();
    context.setLineDash([3, 4]);
    context.lineWidth = 1;
    context.strokeStyle = this.#palette.edge;
    /** @type {Handle | null} */ let before = null;
    for (const handle of handles) {
      if (!['start', 'corner', 'end'].includes(handle.kind)) continue;
      const isNext = before !== null && before.kind !== 'end' && before.dragon === handle.dragon && handle.at - before.at <= 2;
      const isBent = before?.kind === 'corner' || handle.kind === 'corner';
      if (before !== null && isNext && isBent) {
        context.beginPath();
        context.moveTo(...this.#camera.toScreen(before.x_m, before.y_m));
        context.lineTo(...this.#camera.toScreen(handle.x_m, handle.y_m));
        context.stroke();
      }
      before = handle;
    }
    context.restore();
  }

  /** @param {Handle} handle @param {boolean} isChosen */
  #drawHandle(handle, isChosen) {
    const { kind, x_m, y_m, name } = handle;
    const context = this.#context;
    const [x, y] = this.#camera.toScreen(x_m, y_m);
    const isBorder = isOfBorder(handle);
    const size = isMiddle(handle) || kind === 'heading' || isBorder ? SMALL_PX : HANDLE_PX;
    context.beginPath();
    if (isMiddle(handle)) diamond(context, x, y, size);
    else if (isBorder) context.rect(x - size, y - size, 2 * size, 2 * size);
    else context.arc(x, y, size, 0, 2 * Math.PI);
    context.fillStyle = isChosen ? this.#palette.accent : this.#palette.panel;
    context.strokeStyle = isBorder ? this.#palette.edge : this.#palette.accent;
    context.lineWidth = 2.25;
    context.fill();
    context.stroke();
    if (isChosen) this.#drawName(name, x, y - size - 8);
  }

  /** @param {string} name @param {number} x @param {number} y */
  #drawName(name, x, y) {
    const context = this.#context;
    context.font = font(600, 14);
    context.textAlign = 'center';
    context.textBaseline = 'alphabetic';
    context.lineWidth = 4;
    context.lineJoin = 'round';
    context.strokeStyle = this.#palette.halo;
    context.strokeText(name, x, y);
    context.fillStyle = this.#palette.ink;
    context.fillText(name, x, y);
  }

  /** Draws the boards that touch first, where they touch. @param {Contact} contact */
  #drawContact({ boards, point_m }) {
    if (boards === undefined || point_m === undefined) return;
    const context = this.#context;
    for (const corners of boards) {
      context.beginPath();
      for (let at = 0; at < corners.length; at += 2) context.lineTo(...this.#camera.toScreen(corners[at], corners[at + 1]));
      context.closePath();
      context.fillStyle = this.#palette['contact-fill'];
      context.fill();
      context.lineWidth = 1.5;
      context.strokeStyle = this.#palette.halo;
      context.stroke();
    }
    const [x, y] = this.#camera.toScreen(...point_m);
    for (const [width, colour] of /** @type {const} */ ([[5, this.#palette.halo], [2.25, this.#palette.contact]])) {
      context.beginPath();
      context.arc(x, y, 16, 0, 2 * Math.PI);
      context.lineWidth = width;
      context.strokeStyle = colour;
      context.stroke();
    }
  }
}

/** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {number} size */
function diamond(context, x, y, size) {
  context.moveTo(x, y - size);
  context.lineTo(x + size, y);
  context.lineTo(x, y + size);
  context.lineTo(x - size, y);
  context.closePath();
}

/** A pose in the form of a frame of a show. @param {Run} run @param {Pose} pose @returns {import('./frame.js').Frame} */
function frameOf(run, { time_s, handles }) {
  const all = new Float32Array((handles.length / 2) * 3);
  for (let at = 0; at * 2 < handles.length; at += 1) all.set([handles[at * 2], handles[at * 2 + 1]], at * 3);
  const alone = [{ first_bench: 0, first_handle: 0, benches: run.benches }];
  const still = { travel_m: 0, speed_mps: 0 };
  const dragons = (run.dragons ?? alone).map(({ first_bench, first_handle, benches }) => ({ first_bench, first_handle, benches, ...still }));
  const { benches, run_id } = run;
  return {
    ...{ sequence: 0, benches, state: 'paused', run_id, tick: 0, time_s, time_scale: 1, nearest: null, due_ms: 0, dragons, ...still },
    ...{ isFormation: run.dragons !== undefined, handles: all, heights: null },
  };
}
