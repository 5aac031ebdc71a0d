// @ts-check
// The saved version beside the plan: its routes as dashed lines, and its dragons at the same time as lines through their handles.

import { element } from './element.js';

/** @typedef {import('./plan_message.js').Saved} Saved */

const box = element('ghost', HTMLInputElement);
/** Pixels of the dots at the handles of the saved dragons. */
const DOT_PX = 2.5;

export class Ghost {
  /** The text that the planner has. */
  #told = '';
  /** @type {import('./show.js').Run | null} */ #run = null;
  /** @type {number[]} */ #handles = [];

  /** @param {() => void} changed */
  constructor(changed) {
    box.addEventListener('change', changed);
  }

  /** The planner has no text: it was started again. */
  forget() {
    this.#told = '';
  }

  /** What a question contains of the saved version. @param {string} saved the saved text @returns {{saved?: string}} */
  news(saved) {
    const wanted = box.checked ? saved : '';
    if (wanted === this.#told) return {};
    this.#told = wanted;
    this.#run = null;
    return { saved: wanted };
  }

  /** @param {Saved | undefined} saved */
  take(saved) {
    this.#run = saved?.run ?? this.#run;
    this.#handles = saved?.handles ?? [];
  }

  /** @param {CanvasRenderingContext2D} context @param {import('./camera.js').Camera} camera @param {string} colour */
  draw(context, camera, colour) {
    if (this.#run === null) return;
    const { route, benches, dragons = [{ route, benches, first_handle: 0 }] } = this.#run;
    context.save();
    Object.assign(context, { lineWidth: 2, strokeStyle: colour, fillStyle: colour });
    for (const dragon of dragons) {
      context.setLineDash([7, 6]);
      line(context, camera, dragon.route);
      context.setLineDash([]);
      const first = 2 * dragon.first_handle;
      const chain = this.#handles.slice(first, first + 2 * (dragon.benches + 1));
      line(context, camera, chain);
      for (let at = 0; at + 1 < chain.length; at += 2) {
        const [x, y] = camera.toScreen(chain[at], chain[at + 1]);
        context.fillRect(x - DOT_PX, y - DOT_PX, 2 * DOT_PX, 2 * DOT_PX);
      }
    }
    context.restore();
  }
}

/** Draws a line through places. @param {CanvasRenderingContext2D} context @param {import('./camera.js').Camera} camera @param {number[]} places x, y, … */
function line(context, camera, places) {
  context.beginPath();
  for (let at = 0; at + 1 < places.length; at += 2) context.lineTo(...camera.toScreen(places[at], places[at + 1]));
  context.stroke();
}
