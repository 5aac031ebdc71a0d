// @ts-check
// How things stand, in one word: a picture that is not live must never pass for one that is.

import { age, fixed } from './format.js';

/** @typedef {import('./frame.js').Frame} Frame */
/** @typedef {import('./show.js').Server} Server */
/** @typedef {import('./show.js').Show} Show */
/** @typedef {import('./show.js').Status} Status */
/** @typedef {Pick<Show, 'frame' | 'status' | 'status_ms' | 'state_tick'>} Known */
/**
 * @typedef {object} Line how the page stands to the view
 * @property {'connecting' | 'open' | 'lost' | 'ended' | 'refused'} state
 * @property {number} heard_ms when something came last, on the page's clock
 * @property {string | null} reason in one line, where it is refused
 */
/**
 * @typedef {object} Standing
 * @property {string} status for the style sheet
 * @property {string} word
 * @property {string} shape
 * @property {string} explanation
 * @property {boolean} isLive whether the picture is of now, or of an orderly end
 */

/**
 * @param {Line} line
 * @param {Known} show
 * @param {number} now_ms
 * @returns {Standing}
 */
export function standing(line, show, now_ms) {
  switch (line.state) {
    case 'connecting':
      return dead('connecting', 'CONNECTING', 'waiting', 'Looking for the view.');
    case 'refused':
      return dead('refused', 'REFUSED', 'refused', line.reason ?? '');
    case 'ended':
      return dead('view-ended', 'VIEW ENDED', 'ended', 'The view has ended. This page goes on when it is back.');
    case 'lost':
      return dead(
        'view-lost',
        'VIEW LOST',
        'lost',
        `No word from the view for ${since(line.heard_ms, now_ms)}. Connecting again.`,
      );
    case 'open':
      return ofShow(show, now_ms);
  }
}

/**
 * Why no command gets through; `null` where one may. A server that is silent may still take a hold.
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
 * Whether the operator has paused or held the show. The status knows it, but is older than the frame: while it is of a tick
 * before the frame's state, the state has to do.
 * @param {Known} show
 */
export function operatorsStops({ frame, status, state_tick }) {
  const isOfState = (status?.server?.tick ?? -1) >= state_tick;
  const stops = isOfState ? (status?.server?.stops ?? []) : [];
  const [isPaused, isHeld] = ['paused', 'held'].map((stop) => stops.includes(stop));
  switch (frame?.state) {
    case 'running':
      return { isPaused: false, isHeld: false };
    case 'paused':
      return { isPaused: isPaused || !stops.includes('timecode'), isHeld: false };
    case 'held':
      return { isPaused, isHeld: isHeld || status?.guard.kind === 'none' };
    default:
      return { isPaused, isHeld };
  }
}

/** @param {Known} show @param {number} now_ms @returns {Standing} */
function ofShow({ frame, status, status_ms }, now_ms) {
  if (status === null) return dead('connecting', 'CONNECTING', 'waiting', 'Looking for the view.');
  const { state, age_s, reason } = status.link;
  const old = age((age_s ?? 0) + (now_ms - status_ms) / 1e3);
  if (state === 'failed') return dead('failed', 'NO BUS', 'lost', reason ?? 'The bus cannot be read.');
  if (state === 'waiting' || frame === null) return dead('waiting', 'WAITING', 'waiting', 'There is no server yet.');
  if (frame.state === 'ended' || state === 'ended')
    return live('ended', 'ENDED', 'The server has ended in order. This is the last picture of the run.');
  if (frame.state === 'finished') {
    const explanation = state === 'gone' ? 'The show is over, and its server has ended.' : 'The show is over.';
    return live('finished', 'FINISHED', explanation);
  }
  if (state === 'silent')
    return dead('silent', 'SILENT', 'silent', `The server is there, but has said nothing for ${old}.`);
  if (state === 'gone') return dead('lost', 'SERVER LOST', 'lost', `The server is gone. This picture is ${old} old.`);
  switch (frame.state) {
    case 'running':
      return live('running', 'RUNNING', `${frame.benches} benches${timesAsFast(frame.time_scale)}`);
    case 'stopping':
      return live('stopping', 'STOPPING', stopping(status));
    case 'paused':
      return live('paused', 'PAUSED', paused(status.server));
    case 'held':
      return live('held', 'HELD', held(status));
  }
}

/** Why the head brakes, and where it will stand. @param {Status} status */
function stopping({ server, outlook }) {
  const stops = server?.stops ?? [];
  const why = stops.includes('ending')
    ? 'The server was asked to end. '
    : stops.includes('held')
      ? 'A hold. '
      : stops.includes('paused')
        ? 'A pause. '
        : stops.includes('timecode')
          ? 'The timecode stands. '
          : '';
  if (outlook.kind !== 'rest') return `${why}The head brakes.`;
  return `${why}The head stands in ${fixed(outlook.wall_s, 1)} s, after ${fixed(outlook.travel_m, 2)} m.`;
}

/** @param {Server | null} server */
function paused(server) {
  const isOperators = server === null || server.stops.includes('paused');
  const timecode = timecodeOf(server);
  if (!isOperators && timecode === 'waiting') return 'The show waits for its first timecode.';
  if (!isOperators && timecode !== 'none') return 'The timecode stands, and the show with it.';
  return 'The operator has paused the show.';
}

/**
 * A hold is lifted by a release. Where the guard holds the dragon, it waits, has come to the end, or is dead.
 * @param {Status} status
 */
function held({ server, guard }) {
  const isAtLimit = server?.stops.includes('guard_limit') ?? false;
  if (!isAtLimit) return 'Safety stop: only a release lifts it.';
  const holds = guardHolds(guard);
  return server?.stops.includes('held') ? `Safety stop: a release lifts it. ${holds}` : holds;
}

/** @param {Status['guard']} guard */
function guardHolds(guard) {
  switch (guard.kind) {
    case 'missing':
      return 'NO GUARD: the dragon stays here until a guard runs (bench-dragon monitor --guard).';
    case 'at_end':
      return guard.for_good
        ? 'The guard holds for good: further on, benches come nearer than its margin. Only a seek moves the dragon on.'
        : 'The guard holds: further on, benches come nearer than its margin. Timecode may move the dragon on.';
    default:
      return 'The guard is proving the way ahead: the dragon walks on by itself.';
  }
}

/** @param {Server | null} server */
function timecodeOf(server) {
  return server?.timecode ?? 'none';
}

/** @param {string} status @param {string} word @param {string} explanation @returns {Standing} */
function live(status, word, explanation) {
  return { status, word, shape: status, explanation, isLive: true };
}

/** @param {string} status @param {string} word @param {string} shape @param {string} explanation @returns {Standing} */
function dead(status, word, shape, explanation) {
  return { status, word, shape, explanation, isLive: false };
}

/** @param {number} time_scale */
function timesAsFast(time_scale) {
  return time_scale === 1 ? '' : `, ${Number(time_scale.toPrecision(4))} times as fast`;
}

/** @param {number} then_ms @param {number} now_ms */
function since(then_ms, now_ms) {
  return age((now_ms - then_ms) / 1e3);
}
