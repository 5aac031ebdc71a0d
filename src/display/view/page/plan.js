// @ts-check
// The plan: all dragons on their routes, from above.

import { addOutline, board } from './boards.js';
import { fineCanvas } from './canvas.js';
import { extent, lines, outlines } from './dragon_paths.js';
import { millimetres } from './format.js';
import { drawNames } from './dragon_names.js';
import { dragonOf } from './frame.js';
import { drawNearestMark } from './nearest_mark.js';
import { overlapping } from './overlap.js';
import { RouteLayer } from './route_layer.js';
import { drawScaleBar } from './scale_bar.js';

/** @typedef {import('./show.js').Show} Show */
/** @typedef {import('./show.js').Run} Run */
/** @typedef {import('./frame.js').Frame} Frame */
/** @typedef {import('./frame.js').DragonMotion} DragonMotion */
/** @typedef {import('./frame.js').Nearest} Nearest */
/** @typedef {import('./palette.js').Palette} Palette */
/** @typedef {import('./camera.js').Camera} Camera */

/** Width of a board, in pixels, below which it is drawn as a line, since its ends are invisible. */
const LINE_BELOW_PX = 2.5;
/** Width of a line, in canvas pixels, below which it is drawn one pixel wide. */
const WIDE_LINE_PX = 1.5;
/** Width of such a line: slightly below one pixel, so that rounding does not exceed one pixel. */
const HAIRLINE = 0.99;
/** Width of a board, in pixels, from which on its hinges are drawn. */
const HINGES_FROM_PX = 11;
/** Least width of the lines of several dragons, in pixels. */
const FORMATION_LINE_PX = 2;
/** Half the size of the head's mark. */
const HEAD_PX = 13;

export class Plan {
  #canvas;
  #camera;
  #screen;
  /** The nearest pair's clearance as text. */
  #label = '';
  /** @type {Palette} */ #palette;
  #route = new RouteLayer();
  /** @type {import('./route_layer.js').Underlay | null} */ underlay = null;

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

  /**
   * Takes over the clearance that the figures show. Digits that change with each picture would be unreadable. Returns whether
   * the text has changed.
   * @param {Show} show
   */
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
    const { halo: ground, route: ink, edge } = this.#palette;
    this.#route.draw(this.#screen.context, this.#camera, run, { ground, ink, edge }, this.underlay);
    this.#screen.begin();
    if (frame !== null) {
      this.#inPlane(() => this.#drawDragon(frame, run, bench));
      const { nearest } = frame;
      const taken = frame.dragons.map((_, number) => this.#drawHeadMark(frame, run, number));
      taken.push(drawScaleBar(this.#screen.context, this.#camera, this.#palette.quiet));
      if (nearest !== null) {
        const { panel, halo } = this.#palette;
        const look = { text: this.#label, ink: this.#levelColour(nearest, run), ground: panel, halo };
        const label = drawNearestMark(this.#screen.context, this.#camera, frame, run, nearest, look, taken);
        if (label !== null) taken.push(label);
      }
      const { ink, panel } = this.#palette;
      taken.push(...drawNames(this.#screen.context, this.#camera, frame, run, { ink, ground: panel }, taken));
      this.#canvas.dataset.labels = JSON.stringify(taken);
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
    const { scale } = this.#camera;
    const colours = this.#palette;
    const width_px = board(frame, run, 0).halfWidth_m * 2 * scale;
    frame.dragons.forEach((dragon, number) => {
      const own = run?.dragons?.[number]?.colour;
      if (width_px < LINE_BELOW_PX) this.#drawLines(frame, dragon, width_px, own ?? colours.wood);
      else this.#drawBoards(frame, dragon, run, width_px, own);
      const edge = own === undefined ? colours['head-edge'] : colours.ink;
      this.#drawBench(frame, run, dragon.first_bench, own ?? colours.head, edge, own === undefined ? 1 : 2);
    });
    this.#drawSpecial(frame, run, bench);
  }

  /** @param {Frame} frame @param {DragonMotion} dragon @param {number} width_px @param {string} colour */
  #drawLines(frame, dragon, width_px, colour) {
    const { context } = this.#screen;
    context.strokeStyle = colour;
    // At least one canvas pixel: lines of one pixel are drawn several times as fast as wider ones.
    const ratio = this.#screen.ratio();
    // Colours of several dragons need wider lines.
    const least = frame.isFormation ? Math.max(width_px, FORMATION_LINE_PX) : width_px;
    context.lineWidth = (least * ratio < WIDE_LINE_PX ? HAIRLINE / ratio : least) / this.#camera.scale;
    for (const path of lines(frame, dragon, this.#camera)) context.stroke(path);
  }

  /**
   * @param {Frame} frame
   * @param {DragonMotion} dragon
   * @param {Run | null} run
   * @param {number} width_px of a board
   * @param {string | undefined} own the dragon's colour, of several
   */
  #drawBoards(frame, dragon, run, width_px, own) {
    const { context } = this.#screen;
    const colours = this.#palette;
    const edge = own === undefined ? colours['wood-edge'] : colours.ink;
    context.lineWidth = Math.min(Math.max(width_px / 9, 0.6), 2) / this.#camera.scale;
    context.fillStyle = own ?? colours.wood;
    context.strokeStyle = edge;
    const { body, hinges } = outlines(frame, dragon, run, this.#camera, width_px >= HINGES_FROM_PX);
    for (const path of body) {
      context.fill(path);
      context.stroke(path);
    }
    context.fillStyle = edge;
    context.fill(hinges);
  }

  /**
   * Draws the nearest pair, all overlapping boards, and the bench whose details are shown.
   * @param {Frame} frame
   * @param {Run | null} run
   * @param {number | null} bench
   */
  #drawSpecial(frame, run, bench) {
    const colours = this.#palette;
    const { nearest } = frame;
    if (nearest !== null) {
      /** @type {Set<number>} */ const touch = nearest.clearance_m < 0 ? overlapping(frame, run) : new Set();
      for (const one of new Set([...touch, ...nearest.benches])) {
        if (one >= frame.benches) continue;
        const isHead = one === 0 && !touch.has(one);
        const colour = touch.has(one) ? colours['contact-fill'] : this.#levelFill(nearest, run);
        const own = run?.dragons?.[dragonOf(frame, one)]?.colour;
        if (own !== undefined) {
          // The boards of a near pair keep the colours of their dragons.
          const fill = touch.has(one) ? colour : own;
          this.#drawBench(frame, run, one, fill, touch.has(one) ? colours.halo : this.#levelColour(nearest, run), 3);
          continue;
        }
        this.#drawBench(
          frame,
          run,
          one,
          isHead ? colours.head : colour,
          isHead ? colour : colours.halo,
          isHead ? 2.5 : 1,
        );
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
    return this.#palette[/** @type {const} */ ({ contact: 'contact', near: 'near', free: 'pair' })[levelOf(nearest, run)]];
  }

  /** @param {Nearest} nearest @param {Run | null} run */
  #levelFill(nearest, run) {
    return this.#palette[/** @type {const} */ ({ contact: 'contact-fill', near: 'near-fill', free: 'pair' })[levelOf(nearest, run)]];
  }

  /** Draws the position and heading of a dragon's head. Returns its place. @param {Frame} frame @param {Run | null} run @param {number} number */
  #drawHeadMark(frame, run, number) {
    const { first_bench, first_handle } = frame.dragons[number];
    const own = run?.dragons?.[number]?.colour;
    const { ux, uy } = board(frame, run, first_bench);
    const { context } = this.#screen;
    const [x, y] = this.#camera.toScreen(frame.handles[first_handle * 3], frame.handles[first_handle * 3 + 1]);
    const tip = (/** @type {number} */ along, /** @type {number} */ across) =>
      /** @type {const} */ ([x + along * ux + across * uy, y - along * uy + across * ux]);
    context.beginPath();
    context.moveTo(...tip(11, 0));
    context.lineTo(...tip(-6, 7));
    context.lineTo(...tip(-6, -7));
    context.closePath();
    context.lineWidth = 3;
    context.strokeStyle = own === undefined ? this.#palette.halo : this.#palette.ink;
    context.stroke();
    context.fillStyle = own ?? this.#palette.head;
    context.fill();
    return { left: x - HEAD_PX, top: y - HEAD_PX, wide: 2 * HEAD_PX, high: 2 * HEAD_PX };
  }
}

/** @param {Nearest} nearest @param {Run | null} run */
function levelOf({ clearance_m }, run) {
  if (clearance_m <= 0) return 'contact';
  return run !== null && clearance_m <= run.near_m ? 'near' : 'free';
}
