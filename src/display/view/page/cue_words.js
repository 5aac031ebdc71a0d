// @ts-check
// The next cue, and a cue in words.

/**
 * @typedef {object} Cue
 * @property {string} name
 * @property {number} at_s plan time
 * @property {boolean} waits
 * @property {number | null} speed_mps
 * @property {string | null} dragon
 * @property {string | null} note
 * @property {'reached' | 'waiting' | 'next' | 'ahead'} state
 */
/**
 * @typedef {object} CueList
 * @property {Cue[]} cues
 * @property {number | null} next number of the next cue
 * @property {number | null} next_in_s wall time until the next cue
 * @property {number | null} next_time_s show time at the next cue
 */

/** The next cue; `null` if there is none ahead. @param {CueList | null | undefined} cues */
export function nextCue(cues) {
  return cues === null || cues === undefined || cues.next === null ? null : cues.cues[cues.next];
}

/** A cue with its note, in one line. @param {Cue} cue */
export function cueInWords({ name, note }) {
  return note === null ? name : `${name} · ${note}`;
}
