// @ts-check
// What lies ahead, in words. Count-downs are those of the clock on the wall; show time stands beside them.

import * as format from './format.js';

/** @typedef {import('./show.js').Outlook} Outlook */
/**
 * @typedef {object} OutlookWords
 * @property {string} large
 * @property {string} small
 * @property {'far' | 'soon' | 'now'} level how urgent it is
 */

/** A contact that is nearer than this, in seconds of wall time, is one to get ready for, and one to act upon. */
const SOON_S = 60;
const NOW_S = 15;
/** Nearer than this, in seconds, the head is where it will stop. */
const AT_ONCE_S = 0.05;

/**
 * @param {Outlook} outlook
 * @param {import('./frame.js').ShowState | null} state
 * @returns {OutlookWords}
 */
export function outlookInWords(outlook, state) {
  if (state === 'finished' || state === 'ended') return far('–', 'the show is over');
  const walks = state === 'running' || state === 'stopping';
  switch (outlook.kind) {
    case 'contact':
      return {
        large: walks ? `Contact in ${wall(outlook)}` : `Contact ${wall(outlook)} after it goes on`,
        small: `${format.pair(outlook.benches)}, at show time ${format.fixed(outlook.time_s, 3)} s`,
        level: urgency(outlook.wall_s),
      };
    case 'guard_stop':
      return guardStop(outlook, walks);
    case 'rest':
      return far(
        `Stands in ${wall(outlook)}`,
        `after ${format.fixed(outlook.travel_m, 2)} m, at show time ${format.showTime(outlook.time_s)} s`,
      );
    case 'free':
      return outlook.is_end
        ? far('Free to the end', `no contact up to show time ${format.showTime(outlook.time_s)} s`)
        : far(`Free for ${wall(outlook)}`, `up to show time ${format.showTime(outlook.time_s)} s; still looking ahead`);
    case 'unknown':
      return far('–', 'nothing is known of what lies ahead');
  }
}

/** @param {Outlook & {kind: 'guard_stop'}} stop @param {boolean} walks @returns {OutlookWords} */
function guardStop(stop, walks) {
  const { benches, time_s } = stop;
  if (!walks && stop.wall_s < AT_ONCE_S)
    return far('The guard stops the head here', benches === null ? 'no guard runs' : format.pair(benches));
  const why = benches === null ? 'no guard runs' : `before ${format.pair(benches)} come too near`;
  return {
    large: walks ? `Guard stops the head in ${wall(stop)}` : `Guard stops it ${wall(stop)} after it goes on`,
    small: `${why}, at show time ${format.fixed(time_s, 3)} s`,
    level: urgency(stop.wall_s) === 'far' ? 'far' : 'soon',
  };
}

/** @param {import('./show.js').Arrival} arrival */
function wall({ wall_s }) {
  const left_s = Math.max(wall_s, 0);
  return left_s < 600 ? `${format.fixed(left_s, 1)} s` : `${format.minutes(left_s)} min`;
}

/** @param {string} large @param {string} small @returns {OutlookWords} */
function far(large, small) {
  return { large, small, level: 'far' };
}

/** @param {number} left_s until a contact, on the clock on the wall @returns {OutlookWords['level']} */
function urgency(left_s) {
  if (left_s > SOON_S) return 'far';
  return left_s > NOW_S ? 'soon' : 'now';
}
