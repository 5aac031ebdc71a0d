// @ts-check
// The time ahead: the next event, and the wall time that is left.

import { cueInWords, nextCue } from './cue_words.js';
import { countdown, millimetres } from './format.js';

/** @typedef {import('./plan_times.js').PlanTimes} PlanTimes */
/** @typedef {import('./show.js').Show} Show */
/** @typedef {{what: string, time_s: number}} Event what comes, and its show time */

/** Show time, in seconds, up to which an event counts as now. */
const NOW_S = 0.005;
/** Pace of a show that catches up, in multiples of its own, and the least lag at which it is taken to, in seconds. */
const FASTEST = 1.1;
const LEAST_BEHIND_S = 0.02;
/** Show time of a run from which on it counts as endless. */
const ENDLESS_S = 1e6;

/**
 * The events ahead, the next one first: near misses and the contact of the plan, the forecast, and the end.
 * @param {Pick<Show, 'frame' | 'status'>} show
 * @param {PlanTimes} times
 * @param {number | null} end_s show time of the run's end
 * @returns {Event[]}
 */
export function eventsAhead({ frame, status }, times, end_s) {
  if (frame === null || isOver(frame)) return [];
  const events = times.nearMisses.map(({ time_s, clearance_m }) => ({ what: `near miss ${millimetres(clearance_m)} mm`, time_s }));
  if (times.contact !== null) events.push({ what: 'contact', time_s: times.contact.time_s });
  const outlook = status?.outlook;
  if (outlook?.kind === 'guard_stop') events.push({ what: 'guard stop', time_s: outlook.time_s });
  if (outlook?.kind === 'rest') events.push({ what: frame.isFormation ? 'show stops' : 'head stops', time_s: outlook.time_s });
  if (outlook?.kind === 'contact' && times.contact === null) events.push({ what: 'contact', time_s: outlook.time_s });
  if (end_s !== null) events.push({ what: 'end', time_s: end_s });
  const cue = nextCue(status?.cues);
  if (cue !== null && status?.cues?.next_time_s != null) events.push({ what: cueInWords(cue), time_s: status.cues.next_time_s });
  // The head does not get past the guard's stop.
  const last_s = outlook?.kind === 'guard_stop' ? outlook.time_s : Infinity;
  const isAhead = (/** @type {Event} */ { time_s }) => time_s > frame.time_s + NOW_S && time_s <= last_s;
  return events.filter(isAhead).sort((a, b) => a.time_s - b.time_s);
}

/**
 * Show time of the run's end at the head's present speed; `null` if it is unknown or far away.
 * @param {import('./show.js').Run | null} run
 * @param {PlanTimes} times
 */
export function endOf(run, times) {
  if (run === null || run.end_s - run.start_s > ENDLESS_S) return null;
  return times.end_s ?? (times.isComplete ? times.curve.at(-1)?.time_s : undefined) ?? run.end_s;
}

/**
 * The next event in words, with a countdown in wall time.
 * @param {Event | undefined} event
 * @param {Pick<Show, 'frame' | 'status'>} show
 */
export function nextInWords(event, { frame, status }) {
  if (event === undefined || frame === null) return '–';
  const left = countdown(wallSeconds(event.time_s, frame, status));
  return `${event.what} ${walks(frame) ? 'in' : 'after'} ${left}`;
}

/**
 * Show time at which the show gets no further: its end, or the guard's stop before it; `null` if it is unknown, or the guard has
 * stopped the head already.
 * @param {Pick<Show, 'frame' | 'status'>} show
 * @param {number | null} end_s
 */
export function restOf({ frame, status }, end_s) {
  const outlook = status?.outlook;
  if (frame === null || outlook?.kind !== 'guard_stop' || (end_s !== null && end_s < outlook.time_s)) return end_s;
  return outlook.time_s > frame.time_s + NOW_S ? outlook.time_s : null;
}

/**
 * Show time at which the run is expected to end; `null` if it is unknown or the show has gone on beyond its planned end.
 * @param {Pick<Show, 'frame' | 'status'>} show
 * @param {number} planned_s
 */
export function expectedEnd({ frame, status }, planned_s) {
  const outlook = status?.outlook;
  if (outlook?.kind === 'free' && outlook.is_end) return outlook.time_s;
  return frame === null || frame.time_s > planned_s ? null : planned_s;
}

/**
 * The wall time until the end in words; empty if it is unknown.
 * @param {number | null} end_s
 * @param {Pick<Show, 'frame' | 'status'>} show
 */
export function leftInWords(end_s, { frame, status }) {
  if (end_s === null || frame === null || isOver(frame)) return '';
  return `${countdown(Math.max(wallSeconds(end_s, frame, status), 0))} left`;
}

/**
 * Wall time until a show time. A show that catches up does so at its fastest pace, and then goes on at its own.
 * @param {number} time_s
 * @param {import('./frame.js').Frame} frame
 * @param {Show['status']} status
 */
function wallSeconds(time_s, frame, status) {
  const wall_s = (time_s - frame.time_s) / frame.time_scale;
  const behind_s = walks(frame) ? (status?.server?.behind_s ?? 0) : 0;
  const isCaughtUp = behind_s >= LEAST_BEHIND_S && wall_s > behind_s / (FASTEST - 1);
  return isCaughtUp ? FASTEST * wall_s - behind_s : wall_s;
}

/** @param {import('./frame.js').Frame} frame */
const walks = ({ state }) => state === 'running' || state === 'stopping';

/** @param {import('./frame.js').Frame} frame */
const isOver = ({ state }) => state === 'finished' || state === 'ended';
