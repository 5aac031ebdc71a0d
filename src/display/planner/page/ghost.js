// @ts-check
// The saved version beside the plan: its routes as dashed lines.

import { element } from './element.js';

/** @typedef {import('./plan_message.js').PlanMessage} PlanMessage */

const box = element('ghost', HTMLInputElement);

export class Ghost {
  /** @type {PlanMessage | null} */ #plan = null;

  /** @param {() => void} changed */
  constructor(changed) {
    box.addEventListener('change', changed);
  }

  get isKnown() {
    return this.#plan !== null;
  }

  /** Takes a plan if it is the saved one. @param {PlanMessage} plan @param {string} saved the saved text */
  take(plan, saved) {
    if (this.#plan === plan) return;
    if (plan.text === saved) this.#plan = plan;
    else if (this.#plan?.text !== saved) this.#plan = null;
  }

  /** The saved plan, if it is to be shown beside another one. @param {PlanMessage} plan */
  beside(plan) {
    return box.checked && this.#plan !== null && this.#plan.text !== plan.text ? this.#plan : null;
  }

  /** @param {CanvasRenderingContext2D} context @param {import('./camera.js').Camera} camera @param {PlanMessage} plan @param {string} colour */
  draw(context, camera, plan, colour) {
    const saved = this.beside(plan);
    if (saved === null) return;
    context.save();
    context.setLineDash([7, 6]);
    context.lineWidth = 2;
    context.strokeStyle = colour;
    for (const route of saved.run.dragons?.map((dragon) => dragon.route) ?? [saved.run.route]) {
      context.beginPath();
      for (let at = 0; at + 1 < route.length; at += 2) context.lineTo(...camera.toScreen(route[at], route[at + 1]));
      context.stroke();
    }
    context.restore();
  }
}
