// @ts-check
// What the planner has answered so far. Answers of an earlier plan stay, in grey, until newer ones take their place.

/** @typedef {import('./plan_message.js').Answer} Answer */
/** @typedef {import('./plan_message.js').Contact} Contact */
/** @typedef {import('./plan_message.js').PlanMessage} PlanMessage */
/** @typedef {import('./plan_message.js').Pose} Pose */
/** @typedef {import('./curve.js').Sample} Sample */

export class State {
  /** The last good plan. @type {PlanMessage | null} */ plan = null;
  /** @type {Pose} */ pose = { time_s: 0, handles: [] };
  /** @type {Contact} */ contact = { state: 'searching', to_s: 0 };
  /** @type {import('./plan_message.js').BorderFact[]} */ borders = [];
  /** @type {import('./plan_message.js').Miss[]} */ misses = [];
  /** @type {import('./plan_message.js').Speed[]} */ speeds = [];
  /** @type {import('./plan_message.js').Fix[]} */ fixes = [];
  /** @type {Sample[]} */ samples = [];
  /** Whether the facts of the borders are those of this plan. */
  areBordersKnown = false;
  isCurveOld = false;
  isCurveComplete = false;
  /** Whether all is known of this plan. */
  isStudied = false;
  /** Why the text has no plan; `null` if it has. @type {string | null} */ mistake = null;

  /** @param {Answer} answer */
  take(answer) {
    switch (answer.type) {
      case 'plan':
        Object.assign(this, { plan: answer, pose: answer.pose, contact: answer.contact, mistake: null });
        Object.assign(this, { isCurveOld: true, isCurveComplete: false, isStudied: false, areBordersKnown: false, misses: [], fixes: [] });
        this.speeds = this.speeds.slice(0, answer.routes.length);
        break;
      case 'pose':
        this.pose = answer.pose;
        break;
      case 'mistake':
        this.mistake = answer.reason;
        break;
      case 'contact':
        this.contact = answer.contact;
        break;
      case 'curve':
        this.#takeCurve(answer.points, answer.is_complete);
        break;
      case 'borders':
        this.borders = answer.borders;
        this.areBordersKnown = true;
        break;
      case 'misses':
        this.misses = answer.misses;
        break;
      case 'speeds':
        this.speeds = answer.speeds;
        this.isStudied = true;
        break;
      case 'fixes':
        this.fixes = answer.fixes;
        break;
    }
  }

  /** @param {number[]} points @param {boolean} isComplete */
  #takeCurve(points, isComplete) {
    if (this.isCurveOld) this.samples = [];
    for (let at = 0; at + 1 < points.length; at += 2) this.samples.push({ time_s: points[at], clearance_m: points[at + 1] });
    // A coarse curve comes first. The points behind it lie between its points.
    this.samples.sort((one, other) => one.time_s - other.time_s);
    Object.assign(this, { isCurveOld: false, isCurveComplete: isComplete });
  }
}
