// @ts-check
// The planned clearance over show time. The plan is a function of the head's travel, because the state of a dragon is a
// function of its travel alone. The show time at which the head reaches a travel depends on its speed.

/** @typedef {import('./show.js').Clock} Clock */
/** @typedef {import('./show.js').PlannedClearance} PlannedClearance */
/** @typedef {{time_s: number, clearance_m: number}} Point */
/** @typedef {{time_s: number, clearance_m: number, benches: [number, number]}} NearMiss */
/**
 * @typedef {object} PlanTimes
 * @property {boolean} isComplete whether the plan reaches the run's end
 * @property {Point[]} curve in order of time
 * @property {NearMiss[]} nearMisses in order of time
 * @property {{time_s: number, benches: [number, number]} | null} contact
 * @property {number} [end_s] show time of the run's end, of several dragons
 */

/**
 * Greatest difference between the planned start and the clock's start at which the past of the plan is shown, as a share of
 * the show.
 */
const SAME_START = 0.01;

/** No plan is known. @type {PlanTimes} */
export const NO_PLAN = { isComplete: false, curve: [], nearMisses: [], contact: null };

/** Show time at which the head is at a travel. @param {Clock} clock @param {number} travel_m */
export function timeAt(clock, travel_m) {
  return clock.time_s + (travel_m - clock.travel_m) / clock.speed_mps;
}

/**
 * The times of several dragons, with the end. The place of their show is plan time × the leading dragon's planned speed, so the
 * travel of their plan is that place.
 * @param {PlannedClearance | null} plan
 * @param {Clock} clock
 * @param {{start_s: number, end_s: number, planned_speed_mps: number}} run
 * @returns {PlanTimes}
 */
export function timesOfFormation(plan, clock, run) {
  const times = plan === null ? NO_PLAN : planOverTime(plan, clock, run);
  return { ...times, end_s: timeAt(clock, run.end_s * run.planned_speed_mps) };
}

/**
 * Converts the plan to show time. After a change of speed, the part behind the head was walked at another speed, so it is
 * left out.
 * @param {PlannedClearance} plan
 * @param {Clock} clock
 * @param {{start_s: number, end_s: number}} run
 * @returns {PlanTimes}
 */
export function planOverTime({ curve, near_misses, contact, is_complete }, clock, run) {
  const first_s = curve.length === 0 ? run.start_s : timeAt(clock, curve[0]);
  const isAsPlanned = Math.abs(first_s - run.start_s) <= SAME_START * (run.end_s - run.start_s);
  const from_m = isAsPlanned ? -Infinity : clock.travel_m;
  /** @type {Point[]} */
  const points = [];
  for (let at = 0; at < curve.length; at += 2) {
    if (curve[at] >= from_m) points.push({ time_s: timeAt(clock, curve[at]), clearance_m: curve[at + 1] });
  }
  return {
    isComplete: is_complete,
    curve: points,
    nearMisses: near_misses
      .filter(({ travel_m }) => travel_m >= from_m)
      .map(({ travel_m, clearance_m, benches }) => ({ time_s: timeAt(clock, travel_m), clearance_m, benches })),
    contact:
      contact === null || contact.travel_m < from_m
        ? null
        : { time_s: timeAt(clock, contact.travel_m), benches: contact.benches },
  };
}

/**
 * The planned clearance at a show time, interpolated between two points; NaN outside the plan.
 * @param {readonly Point[]} curve
 * @param {number} time_s
 */
export function plannedAt(curve, time_s) {
  const after = curve.findIndex((point) => point.time_s >= time_s);
  if (after < 0) return NaN;
  const later = curve[after];
  if (after === 0) return later.time_s === time_s ? later.clearance_m : NaN;
  const earlier = curve[after - 1];
  const share = (time_s - earlier.time_s) / (later.time_s - earlier.time_s || 1);
  return earlier.clearance_m + share * (later.clearance_m - earlier.clearance_m);
}

/**
 * The plan's near misses and contact, in one line: also those that are behind the head, at times that are not known.
 * @param {PlannedClearance} plan
 * @param {PlanTimes} times
 * @param {boolean} isOver whether the show has ended, so that no planner works on
 * @param {{millimetres: (metres: number) => string, fixed: (value: number, digits: number) => string}} format
 */
export function planInWords({ near_misses, contact, is_complete }, times, isOver, { millimetres, fixed }) {
  if (!is_complete) return isOver ? 'the show ended before its plan was complete' : 'the planner is still computing';
  const at = (/** @type {{time_s: number} | null | undefined} */ event) =>
    event == null ? ', passed' : ` at ${fixed(event.time_s, 1)} s`;
  const words = [];
  if (near_misses.length > 0) {
    const nearest = near_misses.reduce((least, miss) => (miss.clearance_m < least.clearance_m ? miss : least));
    const count = near_misses.length === 1 ? '1 near miss' : `${near_misses.length} near misses, the nearest`;
    const timed = times.nearMisses.find(({ clearance_m }) => clearance_m === nearest.clearance_m);
    words.push(`${count} ${millimetres(nearest.clearance_m)} mm${at(timed)}`);
  }
  words.push(contact === null ? 'no contact' : `contact${at(times.contact)}`);
  return `planned: ${words.join(' · ')}`;
}
