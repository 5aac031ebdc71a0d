// @ts-check
// The state of the show in one word. A picture that is not live must never look live.

import { age, fixed } from './format.js';

/** @typedef {import('./frame.js').Frame} Frame */
/** @typedef {import('./show.js').Server} Server */
/** @typedef {import('./show.js').Show} Show */
/** @typedef {import('./show.js').Status} Status */
/** @typedef {Pick<Show, 'frame' | 'status' | 'status_ms' | 'state_tick'>} Known */
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
 * @property {boolean} isLive whether the picture is current, or the last one of an orderly end
 * @property {boolean} isLost whether nobody can tell what the dragon does now, so that only the wired stop is left
 */

/** Age of the picture in seconds from which on it is old. */
const OLD_S = 1;
const WIRED = 'Use the wired stop.';
/** `serve` alone would start the standard show at its start, without waiting. The hyphens are of the kind that does not break. */
const RESTART = 'A show restarts it, held. By hand, repeat its command with \u2011\u2011held.';

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
        `The view has sent nothing for ${since(line.heard_ms, now_ms)}. ${WIRED} This page reconnects by itself.`,
      );
    case 'open':
      return ofShow(show, now_ms, age_s);
  }
}

/** @param {Outcome} outcome @returns {Standing} */
function ofOutcome({ kind, text }) {
  switch (kind) {
    case 'failed':
    case 'killed':
      return lost('failed', 'SHOW FAILED', 'lost', `${text} ${WIRED}`);
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

/** @param {Known} show @param {number} now_ms @param {number | null} age_s @returns {Standing} */
function ofShow({ frame, status, status_ms }, now_ms, age_s) {
  if (status === null) return dead('connecting', 'CONNECTING', 'waiting', 'Connecting to the view.');
  const { state, reason } = status.link;
  const old = age((status.link.age_s ?? 0) + (now_ms - status_ms) / 1e3);
  if (state === 'failed') return lost('failed', 'NO BUS', 'lost', `${reason ?? 'The bus cannot be read'}. ${WIRED}`);
  if (state === 'waiting' || frame === null) return dead('waiting', 'WAITING', 'waiting', 'There is no server yet.');
  if (frame.state === 'ended' || state === 'ended')
    return live('ended', 'ENDED', 'The server has ended in order. This is the last picture of the run.');
  if (frame.state === 'finished') {
    const explanation = state === 'gone' ? 'The show is over, and its server has ended.' : 'The show is over.';
    return live('finished', 'FINISHED', explanation);
  }
  if (state === 'silent')
    return lost('silent', 'SILENT', 'silent', `The server's process exists, but has sent nothing for ${old}. ${WIRED}`);
  if (state === 'gone') return lost('lost', 'SERVER LOST', 'lost', `The server is gone. This picture is ${old} old. ${WIRED} ${RESTART}`);
  if (age_s === null) return dead('connecting', 'CONNECTING', 'waiting', 'Measuring the age of the picture.');
  if (age_s > OLD_S) return old_picture(frame, age_s);
  switch (frame.state) {
    case 'running':
      return live('running', 'RUNNING', `${frame.benches} benches${timesAsFast(frame.time_scale)}`);
    case 'stopping':
      return live('stopping', 'STOPPING', stopping(status));
    case 'paused':
      return live('paused', 'PAUSED', paused(status.server));
    case 'ready':
      return live('ready', 'READY', 'The dragon waits at its start. A release starts it.');
    case 'held':
      return live('held', 'HELD', held(status));
  }
}

/** The reason for which the head brakes, and its place of rest. @param {Status} status */
function stopping({ server, outlook }) {
  const stops = server?.stops ?? [];
  const why = stops.includes('ending')
    ? 'The server was asked to end. '
    : stops.includes('held')
      ? 'Hold. '
      : stops.includes('paused')
        ? 'Pause. '
        : stops.includes('timecode')
          ? 'The timecode stands still. '
          : '';
  if (outlook.kind !== 'rest') return `${why}The head brakes.`;
  return `${why}The head stops in ${fixed(outlook.wall_s, 1)} s, at ${fixed(outlook.travel_m, 2)} m of travel.`;
}

/** @param {Server | null} server */
function paused(server) {
  const isOperators = server === null || server.stops.includes('paused');
  const timecode = timecodeOf(server);
  if (!isOperators && timecode === 'waiting') return 'The show waits for its first timecode.';
  if (!isOperators && timecode !== 'none') return 'The timecode stands still, so the show stands still.';
  return 'The operator has paused the show.';
}

/**
 * The reason for which the show is held. A release lifts an operator's hold. If the guard holds the dragon, the guard waits,
 * has reached the end of the proven travel, or is missing.
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
        ? 'The guard holds the dragon permanently: ahead, benches come nearer than the margin. Only a seek moves the dragon.'
        : 'The guard holds the dragon: ahead, benches come nearer than the margin. Timecode can move the dragon.';
    default:
      return 'The guard is proving the travel ahead. Then the dragon walks on without a command.';
  }
}

/** @param {Server | null} server */
function timecodeOf(server) {
  return server?.timecode ?? 'none';
}

/** @param {string} status @param {string} word @param {string} explanation @returns {Standing} */
function live(status, word, explanation) {
  return { status, word, shape: status, explanation, isLive: true, isLost: false };
}

/** @param {string} status @param {string} word @param {string} shape @param {string} explanation @returns {Standing} */
function dead(status, word, shape, explanation) {
  return { status, word, shape, explanation, isLive: false, isLost: false };
}

/** @param {string} status @param {string} word @param {string} shape @param {string} explanation @returns {Standing} */
function lost(status, word, shape, explanation) {
  return { status, word, shape, explanation, isLive: false, isLost: true };
}

/** @param {Frame} frame @param {number} age_s */
function old_picture({ state }, age_s) {
  return lost('old', 'OLD PICTURE', 'old', `Picture ${age(age_s)} old: the network is slow. It shows the show ${state}. ${WIRED}`);
}

/** @param {number} time_scale */
function timesAsFast(time_scale) {
  return time_scale === 1 ? '' : `, ${Number(time_scale.toPrecision(4))} times as fast`;
}

/** @param {number} then_ms @param {number} now_ms */
function since(then_ms, now_ms) {
  return age((now_ms - then_ms) / 1e3);
}
