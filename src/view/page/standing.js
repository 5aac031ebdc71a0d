// @ts-check
// How things stand, in one word: a picture that is not live must never pass for one that is.

import { age } from './format.js';

/** @typedef {import('./show.js').Show} Show */
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
 * @property {boolean} isLive whether the picture is of now
 */

/**
 * @param {Line} line
 * @param {Show} show
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
      return dead('ended', 'ENDED', 'ended', 'The view has ended. This page goes on when it is back.');
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

/** @param {Show} show @param {number} now_ms @returns {Standing} */
function ofShow({ frame, status, status_ms }, now_ms) {
  if (status === null) return dead('connecting', 'CONNECTING', 'waiting', 'Looking for the view.');
  const { state, age_s, reason } = status.link;
  const old = age((age_s ?? 0) + (now_ms - status_ms) / 1e3);
  if (state === 'failed') return dead('failed', 'NO BUS', 'lost', reason ?? 'The bus cannot be read.');
  if (state === 'waiting' || frame === null) return dead('waiting', 'WAITING', 'waiting', 'There is no server yet.');
  if (frame.state === 'finished') {
    const explanation = state === 'gone' ? 'The show is over, and its server has ended.' : 'The show is over.';
    return { status: 'finished', word: 'FINISHED', shape: 'finished', explanation, isLive: true };
  }
  if (state === 'silent')
    return dead('silent', 'SILENT', 'silent', `The server is there, but has said nothing for ${old}.`);
  if (state === 'gone') return dead('lost', 'SERVER LOST', 'lost', `The server is gone. This picture is ${old} old.`);
  switch (frame.state) {
    case 'running':
      return live('running', 'RUNNING', `${frame.benches} benches${pace(frame.time_scale)}`);
    case 'paused':
      return live('paused', 'PAUSED', 'The operator has paused the show.');
    case 'held':
      return live('held', 'HELD', status.server?.is_at_grants_end
        ? 'At the end of what the guard has granted: it walks on when the way ahead is proved free.'
        : 'Safety stop: only a release lifts it.');
  }
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
function pace(time_scale) {
  return time_scale === 1 ? '' : `, ${Number(time_scale.toPrecision(4))} times as fast`;
}

/** @param {number} then_ms @param {number} now_ms */
function since(then_ms, now_ms) {
  return age((now_ms - then_ms) / 1e3);
}
