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
 */

/**
 * @param {Line} line
 * @param {Known} show
 * @param {number} now_ms
 * @returns {Standing}
 */
export function standing(line, show, now_ms) {
  if (line.outcome !== null && line.state !== 'refused') return ofOutcome(line.outcome);
  switch (line.state) {
    case 'connecting':
      return dead('connecting', 'CONNECTING', 'waiting', 'Connecting to the view.');
    case 'refused':
      return dead('refused', 'REFUSED', 'refused', line.reason ?? '');
    case 'ended':
      return dead('view-ended', 'VIEW ENDED', 'ended', 'The view has ended. This page reconnects when the view runs again.');
    case 'lost':
      return dead(
        'view-lost',
        'VIEW LOST',
        'lost',
        `The view has sent nothing for ${since(line.heard_ms, now_ms)}. Reconnecting.`,
      );
    case 'open':
      return ofShow(show, now_ms);
  }
}

/** @param {Outcome} outcome @returns {Standing} */
function ofOutcome({ kind, text }) {
  switch (kind) {
    case 'failed':
    case 'killed':
      return dead('failed', 'SHOW FAILED', 'lost', text);
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
 * Whether the operator has paused or held the show. The status contains this, but may be older than the frame. If the status
 * is older than the frame's state, that state decides.
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
  if (status === null) return dead('connecting', 'CONNECTING', 'waiting', 'Connecting to the view.');
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
    return dead('silent', 'SILENT', 'silent', `The server's process exists, but has sent nothing for ${old}.`);
  if (state === 'gone') return dead('lost', 'SERVER LOST', 'lost', `The server is gone. This picture is ${old} old.`);
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
