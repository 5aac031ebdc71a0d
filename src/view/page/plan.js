// @ts-check
// Draws the dragon on its route, from above.

import { addOutline, board } from './boards.js';
import { fineCanvas, font } from './canvas.js';
import { millimetres } from './format.js';
import { gap } from './gap.js';
import { overlapping } from './overlap.js';
import { RouteLayer } from './route_layer.js';

/** @typedef {import('./show.js').Show} Show */
/** @typedef {import('./show.js').Run} Run */
/** @typedef {import('./frame.js').Frame} Frame */
/** @typedef {import('./frame.js').Nearest} Nearest */
/** @typedef {import('./palette.js').Palette} Palette */
/** @typedef {import('./camera.js').Camera} Camera */

/** Boards that are narrower than this, in pixels, are drawn as one line: nobody sees their ends. */
const LINE_BELOW_PX = 2.5;
/** Lines that are narrower than this, in the screen's own pixels, are drawn one pixel wide. */
const WIDE_LINE_PX = 1.5;
/** Boards of at least this width show their hinges. */
const HINGES_FROM_PX = 11;
/** Boards in one path: the cost of filling a path grows faster than its length. */
const BOARDS_A_PATH = 16;
const SCALE_BAR_PX = 130;
/** What the buttons at the right take of the plan. */
const LENSES_PX = 72;

export class Plan {
  #canvas;
  #camera;
  #screen;
  /** The nearest pair's clearance, as it is read. */
  #label = '';
  /** @type {Palette} */ #palette;
  #route = new RouteLayer();

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {Camera} camera
   * @param {Palette} palette
   * @param {() => void} changed
   */
  constructor(canvas, camera, palette, changed) {
    this.#canvas = canvas;
    this.#camera = camera;
    this.#palette = palette;
    this.#screen = fineCanvas(canvas, (width, height) => {
      camera.resize(width, height);
      changed();
    });
  }

  /** Has the plan show the clearance that the figures show: digits that change with each picture nobody reads. @param {Show} show */
  read({ frame }) {
    const label = `${millimetres(frame?.nearest?.clearance_m)} mm`;
    const isOther = label !== this.#label;
    this.#label = label;
    return isOther;
  }

  /** @param {Palette} palette */
  recolour(palette) {
    this.#palette = palette;
  }

  /**
   * @param {Show} show
   * @param {number | null} bench whose details are shown
   */
  draw(show, bench) {
    const { frame, run } = { frame: show.frame, run: show.runOfFrame() };
    this.#aim(frame, run);
    this.#route.draw(this.#screen.context, this.#camera, run, { ground: this.#palette.halo, ink: this.#palette.route });
    this.#screen.begin();
    if (frame !== null) {
      this.#inPlane(() => this.#drawDragon(frame, run, bench));
      if (frame.nearest !== null) this.#drawNearest(frame, run, frame.nearest);
      this.#drawHeadMark(frame, run);
      this.#drawScaleBar();
    }
    const { x, y, scale } = this.#camera;
    this.#canvas.dataset.camera = `${x} ${y} ${scale}`;
  }

  /** @param {Frame | null} frame @param {Run | null} run */
  #aim(frame, run) {
    if (frame === null) return;
    if (this.#camera.mode === 'follow') this.#camera.centre(frame.handles[0], frame.handles[1]);
    if (this.#camera.mode === 'fit') this.#camera.fit(extent(frame, run));
  }

  /** Draws in metres. @param {() => void} draw */
  #inPlane(draw) {
    const { context } = this.#screen;
    const { x, y, scale, width, height } = this.#camera;
    context.save();
    context.transform(scale, 0, 0, -scale, width / 2 - x * scale, height / 2 + y * scale);
    draw();
    context.restore();
  }

  /** @param {Frame} frame @param {Run | null} run @param {number | null} bench */
  #drawDragon(frame, run, bench) {
    const { context } = this.#screen;
    const { scale } = this.#camera;
    const colours = this.#palette;
    const width_px = board(frame, run, 0).halfWidth_m * 2 * scale;
    if (width_px < LINE_BELOW_PX) {
      context.strokeStyle = colours.wood;
      // At least one of the screen's own pixels: lines of one are drawn several times as fast as wider ones.
      const ratio = this.#screen.ratio();
      context.lineWidth = (width_px * ratio < WIDE_LINE_PX ? 1 / ratio : width_px) / scale;
      for (const path of lines(frame, this.#camera)) context.stroke(path);
    } else {
      context.lineWidth = Math.min(Math.max(width_px / 9, 0.6), 2) / scale;
      context.fillStyle = colours.wood;
      context.strokeStyle = colours['wood-edge'];
      const { body, hinges } = outlines(frame, run, this.#camera, width_px >= HINGES_FROM_PX);
      for (const path of body) {
        context.fill(path);
        context.stroke(path);
      }
      context.fillStyle = colours['wood-edge'];
      context.fill(hinges);
    }
    this.#drawBench(frame, run, 0, colours.head, colours['head-edge']);
    this.#drawSpecial(frame, run, bench);
  }

  /** The nearest pair, whatever overlaps, and the bench that is looked at. @param {Frame} frame @param {Run | null} run @param {number | null} bench */
  #drawSpecial(frame, run, bench) {
    const colours = this.#palette;
    const { nearest } = frame;
    if (nearest !== null) {
      /** @type {Set<number>} */ const touch = nearest.clearance_m < 0 ? overlapping(frame, run) : new Set();
      for (const one of new Set([...touch, ...nearest.benches])) {
        if (one >= frame.benches) continue;
        const isHead = one === 0 && !touch.has(one);
        const colour = touch.has(one) ? colours.contact : this.#levelColour(nearest, run);
        this.#drawBench(frame, run, one, isHead ? colours.head : colour, isHead ? colour : colours.halo, isHead ? 2.5 : 1);
      }
    }
    if (bench !== null && bench < frame.benches) this.#drawBench(frame, run, bench, null, colours.ink, 2.5);
  }

  /**
   * @param {Frame} frame
   * @param {Run | null} run
   * @param {number} bench
   * @param {string | null} fill
   * @param {string} edge
   * @param {number} [edge_px]
   */
  #drawBench(frame, run, bench, fill, edge, edge_px = 1) {
    const { context } = this.#screen;
    const outline = new Path2D();
    addOutline(outline, board(frame, run, bench));
    if (fill !== null) {
      context.fillStyle = fill;
      context.fill(outline);
    }
    context.lineWidth = edge_px / this.#camera.scale;
    context.strokeStyle = edge;
    context.stroke(outline);
  }

  /** @param {Nearest} nearest @param {Run | null} run */
  #levelColour(nearest, run) {
    if (nearest.clearance_m <= 0) return this.#palette.contact;
    return run !== null && nearest.clearance_m <= run.near_m ? this.#palette.near : this.#palette.pair;
  }

  /** A ring around the place, the gap itself where it is wide enough to be seen, and its size. @param {Frame} frame @param {Run | null} run @param {Nearest} nearest */
  #drawNearest(frame, run, nearest) {
    const { context } = this.#screen;
    const { scale, width, height } = this.#camera;
    const [x, y] = this.#camera.toScreen(...nearest.point_m);
    if (x < -20 || y < -20 || x > width + 20 || y > height + 20) return;
    const colour = this.#levelColour(nearest, run);
    const [a, b] = nearest.benches.map((bench) => board(frame, run, bench));
    const radius = Math.min(Math.max(13, nearest.clearance_m * scale * 0.75 + 6), 60);
    context.lineWidth = 5;
    context.strokeStyle = this.#palette.halo;
    ring(context, x, y, radius);
    context.lineWidth = 2.25;
    context.strokeStyle = colour;
    ring(context, x, y, radius);
    if (nearest.clearance_m > 0) {
      const [[ax, ay], [bx, by]] = gap(a, b).map((point) => this.#camera.toScreen(...point));
      context.beginPath();
      context.moveTo(ax, ay);
      context.lineTo(bx, by);
      context.stroke();
    }
    this.#drawLabel(this.#label, x, y, radius, colour);
  }

  /** @param {string} text @param {number} x @param {number} y @param {number} radius @param {string} colour */
  #drawLabel(text, x, y, radius, colour) {
    const { context } = this.#screen;
    context.font = font(650, 15);
    const [wide, high] = [context.measureText(text).width + 18, 27];
    // Up and to the right of the ring, or to the left where the screen ends.
    const isRight = x + radius + 22 + wide < this.#camera.width - LENSES_PX;
    const [fromX, fromY] = [x + (isRight ? 1 : -1) * radius * Math.SQRT1_2, y - radius * Math.SQRT1_2];
    const [atX, atY] = [fromX + (isRight ? 14 : -14 - wide), Math.max(fromY - 14 - high / 2, 4)];
    context.beginPath();
    context.moveTo(fromX, fromY);
    context.lineTo(isRight ? atX : atX + wide, atY + high / 2);
    context.stroke();
    context.beginPath();
    context.roundRect(atX, atY, wide, high, 7);
    context.fillStyle = this.#palette.panel;
    context.fill();
    context.lineWidth = 1.75;
    context.stroke();
    context.fillStyle = colour;
    context.textBaseline = 'middle';
    context.textAlign = 'left';
    context.fillText(text, atX + 9, atY + high / 2 + 1);
  }

  /** Where the head is, while its board is too small to be seen. @param {Frame} frame @param {Run | null} run */
  #drawHeadMark(frame, run) {
    const { ux, uy, halfWidth_m } = board(frame, run, 0);
    if (halfWidth_m * 2 * this.#camera.scale >= 5) return;
    const { context } = this.#screen;
    const [x, y] = this.#camera.toScreen(frame.handles[0], frame.handles[1]);
    const tip = (/** @type {number} */ along, /** @type {number} */ across) => /** @type {const} */ ([x + along * ux + across * uy, y - along * uy + across * ux]);
    context.beginPath();
    context.moveTo(...tip(11, 0));
    context.lineTo(...tip(-6, 7));
    context.lineTo(...tip(-6, -7));
    context.closePath();
    context.lineWidth = 3;
    context.strokeStyle = this.#palette.halo;
    context.stroke();
    context.fillStyle = this.#palette.head;
    context.fill();
  }

  #drawScaleBar() {
    const { context } = this.#screen;
    const length_m = roundLength(SCALE_BAR_PX / this.#camera.scale);
    const length_px = length_m * this.#camera.scale;
    const [x, y] = [18, this.#camera.height - 18];
    context.strokeStyle = this.#palette.quiet;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x, y - 5);
    context.lineTo(x, y);
    context.lineTo(x + length_px, y);
    context.lineTo(x + length_px, y - 5);
    context.stroke();
    context.fillStyle = this.#palette.quiet;
    context.font = font(500, 12);
    context.textBaseline = 'alphabetic';
    context.textAlign = 'left';
    context.fillText(length_m < 1 ? `${Math.round(length_m * 1000)} mm` : `${length_m} m`, x + 6, y - 5);
  }
}

/** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {number} radius */
function ring(context, x, y, radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.stroke();
}

/** The dragon and its route. @param {Frame} frame @param {Run | null} run */
function extent(frame, run) {
  const box = { x0: Infinity, y0: Infinity, x1: -Infinity, y1: -Infinity };
  const include = (/** @type {ArrayLike<number>} */ values, /** @type {number} */ stride) => {
    for (let at = 0; at + 1 < values.length; at += stride) {
      box.x0 = Math.min(box.x0, values[at]);
      box.x1 = Math.max(box.x1, values[at]);
      box.y0 = Math.min(box.y0, values[at + 1]);
      box.y1 = Math.max(box.y1, values[at + 1]);
    }
  };
  include(frame.handles, 3);
  if (run !== null) include(run.route, 2);
  return box;
}

/** @param {ArrayLike<number>} values @param {number} stride */
function polyline(values, stride) {
  const path = new Path2D();
  for (let at = 0; at + 1 < values.length; at += stride) path.lineTo(values[at], values[at + 1]);
  return path;
}

/**
 * The dragon as lines, each of a part of it; those out of sight are left out.
 * @param {Frame} frame
 * @param {Camera} camera
 */
function* lines({ handles, benches }, camera) {
  for (let first = 0; first < benches; first += BOARDS_A_PATH) {
    const last = Math.min(first + BOARDS_A_PATH, benches);
    const part = handles.subarray(first * 3, (last + 1) * 3);
    if (isSeen(part, camera, 0)) yield polyline(part, 3);
  }
}

/**
 * The boards that are in sight, and their hinges.
 * @param {Frame} frame
 * @param {Run | null} run
 * @param {Camera} camera
 * @param {boolean} withHinges
 */
function outlines(frame, run, camera, withHinges) {
  /** @type {Path2D[]} */ const body = [];
  const hinges = new Path2D();
  for (let first = 0; first < frame.benches; first += BOARDS_A_PATH) {
    const last = Math.min(first + BOARDS_A_PATH, frame.benches);
    const part = frame.handles.subarray(first * 3, (last + 1) * 3);
    if (!isSeen(part, camera, 2)) continue;
    const path = new Path2D();
    for (let bench = first; bench < last; bench += 1) {
      addOutline(path, board(frame, run, bench));
      if (withHinges) {
        const [x, y] = [frame.handles[bench * 3], frame.handles[bench * 3 + 1]];
        hinges.moveTo(x + HINGE_RADIUS_M, y);
        hinges.arc(x, y, HINGE_RADIUS_M, 0, 2 * Math.PI);
      }
    }
    body.push(path);
  }
  return { body, hinges };
}

const HINGE_RADIUS_M = 0.028;

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

/** The next smaller length of 1, 2 or 5 times a power of ten. @param {number} most_m */
function roundLength(most_m) {
  const power = 10 ** Math.floor(Math.log10(most_m));
  const step = [5, 2, 1].find((factor) => factor * power <= most_m) ?? 1;
  return Number((step * power).toPrecision(1));
}
