// @ts-check
// The forecast in words. Countdowns are in seconds of wall time, with show time beside them.

import * as format from './format.js';

/** @typedef {import('./show.js').Outlook} Outlook */
/**
 * @typedef {object} OutlookWords
 * @property {string} large
 * @property {string} small
 * @property {'far' | 'soon' | 'now'} level urgency
 */

/** Wall time until a contact, in seconds, up to which it needs attention, and up to which it needs action. */
const SOON_S = 60;
const NOW_S = 15;
/** Wall time until a stop, in seconds, below which a standing head is already at its stop. */
const AT_ONCE_S = 0.05;

/**
 * @param {Outlook} outlook
 * @param {import('./frame.js').ShowState | null} state
 * @param {import('./show.js').Arrival | null} [possible] where the play of the hinges allows a contact first
 * @param {boolean} [isFormation] whether the place of the show is plan time, not the travel of the only head
 * @returns {OutlookWords}
 */
export function outlookInWords(outlook, state, possible = null, isFormation = false) {
  if (state === 'finished' || state === 'ended') return far('–', 'the show is over');
  const walks = state === 'running' || state === 'stopping';
  switch (outlook.kind) {
    case 'contact':
      return {
        large: walks ? `Contact in ${wall(outlook)}` : `Contact after ${wall(outlook)} of walking`,
        small: `${format.pair(outlook)}, at show time ${format.fixed(outlook.time_s, 3)} s${from(possible)}`,
        level: urgency(outlook.wall_s),
      };
    case 'guard_stop':
      return guardStop(outlook, walks, isFormation ? 'show' : 'head');
    case 'rest':
      return isFormation
        ? far(`Show stops in ${wall(outlook)}`, `at show time ${format.showTime(outlook.time_s)} s`)
        : far(
            `Head stops in ${wall(outlook)}`,
            `at ${format.fixed(outlook.travel_m, 2)} m of travel, show time ${format.showTime(outlook.time_s)} s`,
          );
    case 'free':
      return outlook.is_end
        ? far('No contact to the end', `searched up to show time ${format.showTime(outlook.time_s)} s${from(possible)}`)
        : far(`No contact for ${wall(outlook)}`, `up to show time ${format.showTime(outlook.time_s)} s; the search continues${from(possible)}`);
    case 'unknown':
      return far('–', 'no forecast available');
  }
}

/** @param {Outlook & {kind: 'guard_stop'}} stop @param {boolean} walks @param {'show' | 'head'} what @returns {OutlookWords} */
function guardStop(stop, walks, what) {
  const { time_s } = stop;
  const pair = stop.benches === null ? null : format.pair({ ...stop, benches: stop.benches });
  if (!walks && stop.wall_s < AT_ONCE_S) return far(`The guard stops the ${what} here`, pair ?? 'no guard runs');
  const why = pair === null ? 'no guard runs' : `before ${pair} come too near`;
  return {
    large: walks ? `Guard stops the ${what} in ${wall(stop)}` : `Guard stops the ${what} after ${wall(stop)} of walking`,
    small: `${why}, at show time ${format.fixed(time_s, 3)} s`,
    level: urgency(stop.wall_s) === 'far' ? 'far' : 'soon',
  };
}

/** @param {import('./show.js').Arrival} arrival */
function wall({ wall_s }) {
  const left_s = Math.max(wall_s, 0);
  return left_s < 600 ? `${format.fixed(left_s, 1)} s` : `${format.minutes(left_s)} min`;
}

/** @param {import('./show.js').Arrival | null} possible */
function from(possible) {
  return possible === null ? '' : `; with play in the hinges possible from ${format.fixed(possible.time_s, 3)} s`;
}

/** @param {string} large @param {string} small @returns {OutlookWords} */
function far(large, small) {
  return { large, small, level: 'far' };
}

/** @param {number} left_s wall time until a contact @returns {OutlookWords['level']} */
function urgency(left_s) {
  if (left_s > SOON_S) return 'far';
  return left_s > NOW_S ? 'soon' : 'now';
}
