// @ts-check
// The state of the show in one word. A picture that is not live must never look live.

import { age } from './format.js';

/** @typedef {import('./frame.js').Frame} Frame */
/** @typedef {import('./show.js').Show} Show */
/** @typedef {import('./show.js').Status} Status */
/** @typedef {Pick<Show, 'frame' | 'status' | 'state_tick'>} Known */
/**
 * @typedef {object} Line the page's connection to the view
 * @property {'connecting' | 'open' | 'lost' | 'ended' | 'refused'} state
 * @property {number} heard_ms time of the last message, on the page's clock
 * @property {string | null} reason reason of a refusal, in one line
 * @property {Outcome | null} outcome of a show that has ended
 */
/** @typedef {{kind: string, text: string}} Outcome why a show has ended: its kind, and one sentence */
/**
 * @typedef {object} Standing
 * @property {string} status for the style sheet
 * @property {string} word
 * @property {string} shape
 * @property {string} explanation
 * @property {string | null} remedy what to do
 * @property {'calm' | 'good' | 'caution' | 'danger'} level
 * @property {boolean} isLive whether the picture is current, or the last one of an orderly end
 * @property {boolean} isLost whether nobody can tell what the dragon does now, so that only the wired stop is left
 */

/** Age of the picture in seconds from which on it is old. */
const OLD_S = 1;
const WIRED = 'Use the wired stop.';

/**
 * @param {Line} line
 * @param {Known} show
 * @param {number} now_ms
 * @param {number | null} age_s greatest possible age of a picture that the view calls current; `null` before it is measured
 * @returns {Standing}
 */
export function standing(line, show, now_ms, age_s) {
  if (line.outcome !== null && line.state !== 'refused') return ofOutcome(line.outcome);
  switch (line.state) {
    case 'connecting':
      return dead('connecting', 'CONNECTING', 'waiting', 'Connecting to the view.');
    case 'refused':
      return dead('refused', 'REFUSED', 'refused', line.reason ?? '');
    case 'ended':
      return dead('view-ended', 'VIEW ENDED', 'ended', 'The view has ended. This page reconnects when the view runs again.');
    case 'lost':
      return lost(
        'view-lost',
        'VIEW LOST',
        'lost',
        `The view has sent nothing for ${since(line.heard_ms, now_ms)}.`,
        'This page reconnects by itself.',
      );
    case 'open':
      return ofShow(show, age_s);
  }
}

/** @param {Outcome} outcome @returns {Standing} */
function ofOutcome({ kind, text }) {
  switch (kind) {
    case 'failed':
    case 'killed':
      return lost('failed', 'SHOW FAILED', 'lost', text);
    case 'contact':
      return live('ended', 'CONTACT', `${text} The show has ended.`);
    case 'guard':
      return live('ended', 'GUARD STOP', `${text} The show has ended.`);
    default:
      return live('ended', 'SHOW ENDED', text);
  }
}

/**
 * The reason for which no command can reach the server; `null` if one can. A silent server may still accept a hold.
 * @param {Line} line
 * @param {Known} show
 */
export function obstacle(line, { frame, status }) {
  if (line.state !== 'open') return 'There is no connection to the view.';
  const link = status?.link.state ?? 'waiting';
  if (link === 'failed') return 'The bus cannot be read.';
  if (frame?.state === 'ended' || link === 'ended') return 'The server has ended.';
  return link === 'live' || link === 'silent' ? null : 'There is no server.';
}

/**
 * Whether the operator has paused or held the show, or has not started it. The status contains this, but may be older than the frame. If the status
 * is older than the frame's state, that state decides.
 * @param {Known} show
 */
export function operatorsStops({ frame, status, state_tick }) {
  const isOfState = (status?.server?.tick ?? -1) >= state_tick;
  const stops = isOfState ? (status?.server?.stops ?? []) : [];
  const [isPaused, isHeld] = ['paused', 'held'].map((stop) => stops.includes(stop));
  const isReady = frame?.state === 'ready';
  switch (frame?.state) {
    case 'running':
      return { isPaused: false, isHeld: false, isReady };
    case 'paused':
      return { isPaused: isPaused || !stops.includes('timecode'), isHeld: false, isReady };
    case 'held':
      return { isPaused, isHeld: isHeld || status?.guard.kind === 'none', isReady };
    default:
      return { isPaused, isHeld, isReady };
  }
}

/** @param {Known} show @param {number | null} age_s @returns {Standing} */
function ofShow({ frame, status }, age_s) {
  if (status === null) return dead('connecting', 'CONNECTING', 'waiting', 'Connecting to the view.');
  const { link, standing } = status;
  const { word, cause, remedy } = standing;
  if (link.state === 'failed') return lost('failed', word, 'lost', cause, remedy);
  if (link.state === 'waiting' || frame === null) return { ...dead('waiting', word, 'waiting', cause), remedy };
  if (word === 'SHOW LOST') return lost('lost', word, 'lost', cause, remedy);
  if (frame.state === 'ended' || link.state === 'ended')
    return live('ended', 'ENDED', 'The server has ended in order. This is the last picture of the run.');
  if (frame.state === 'finished' && link.state === 'gone')
    return live('finished', 'FINISHED', 'The show is over, and its server has ended.');
  if (link.state === 'silent') return lost('silent', word, 'silent', cause, remedy);
  if (link.state === 'gone') return lost('lost', word, 'lost', cause, remedy);
  if (age_s === null) return dead('connecting', 'CONNECTING', 'waiting', 'Measuring the age of the picture.');
  if (age_s > OLD_S) return oldPicture(frame, age_s);
  return ofState(frame, standing);
}

/**
 * The standing of a live show. The view's sentences are up to 0.2 s older than the frame, so they may belong to an earlier state.
 * @param {Frame} frame
 * @param {Status['standing']} standing
 * @returns {Standing}
 */
function ofState({ state, time_scale }, { level, word, cause, remedy }) {
  const own = state === 'waiting' ? live('cue', 'WAITING FOR GO', '') : live(state, state.toUpperCase(), '');
  if (word !== own.word) return own;
  return { ...own, level, explanation: state === 'running' ? cause + timesAsFast(time_scale) : cause, remedy };
}

/** @param {string} status @param {string} word @param {string} explanation @returns {Standing} */
function live(status, word, explanation) {
  return { status, word, shape: status, explanation, remedy: null, level: 'caution', isLive: true, isLost: false };
}

/** @param {string} status @param {string} word @param {string} shape @param {string} explanation @returns {Standing} */
function dead(status, word, shape, explanation) {
  return { ...live(status, word, explanation), shape, isLive: false };
}

/**
 * @param {string} status @param {string} word @param {string} shape @param {string} explanation
 * @param {string | null} [remedy]
 * @returns {Standing}
 */
function lost(status, word, shape, explanation, remedy = null) {
  return { ...dead(status, word, shape, `${explanation} ${WIRED}`), remedy, isLost: true };
}

/** @param {Frame} frame @param {number} age_s */
function oldPicture({ state }, age_s) {
  return lost('old', 'OLD PICTURE', 'old', `Picture ${age(age_s)} old: the network is slow. It shows the show ${state}.`);
}

/** @param {number} time_scale */
function timesAsFast(time_scale) {
  return time_scale === 1 ? '' : ` Show time runs ${Number(time_scale.toPrecision(4))} times as fast.`;
}

/** @param {number} then_ms @param {number} now_ms */
function since(then_ms, now_ms) {
  return age((now_ms - then_ms) / 1e3);
}
