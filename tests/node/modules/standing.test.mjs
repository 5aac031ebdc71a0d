// Tests of the state of the show in words.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { obstacle, operatorsStops, standing } from '../../../src/display/view/page/standing.js';

const OPEN = { state: 'open', heard_ms: 0, reason: null, outcome: null };
const LIVE = { state: 'live', age_s: null, reason: null };
const GONE = { state: 'gone', age_s: 2, reason: null };

function show(state, { link = LIVE, guard = { kind: 'none' }, outlook = { kind: 'unknown' }, stops = [], timecode = 'none' } = {}) {
  const server = { tick: 9, stops, timecode, source: 'server' };
  return {
    frame: { state, benches: 223, time_scale: 1 },
    status: { link, guard, outlook, server },
    status_ms: 0,
    state_tick: 9,
  };
}

const stands = (state, situation) => standing(OPEN, show(state, situation), 0);

test('an orderly end is no alarm, with or without a server process', () => {
  for (const link of [LIVE, GONE]) {
    const { status, word, isLive } = stands('ended', { link });
    assert.deepEqual([status, word, isLive], ['ended', 'ENDED', true]);
  }
  assert.equal(stands('running', { link: GONE }).word, 'SERVER LOST');
  assert.equal(standing({ ...OPEN, state: 'ended' }, show('running'), 0).word, 'VIEW ENDED');
});

test('each end of a show has its word and its sentence, also after the view has ended', () => {
  for (const state of ['open', 'ended', 'lost']) {
    const end = (kind) => standing({ ...OPEN, state, outcome: { kind, text: `It was ${kind}.` } }, show('held'), 0);
    const words = ['failed', 'guard', 'contact', 'end_of_run', 'stopped'].map((kind) => end(kind).word);
    assert.deepEqual(words, ['SHOW FAILED', 'GUARD STOP', 'CONTACT', 'SHOW ENDED', 'SHOW ENDED']);
    assert.equal(end('failed').isLive, false);
    assert.match(end('guard').explanation, /^It was guard/);
  }
});

test('a stopping head has its reason and its place of rest', () => {
  const outlook = { kind: 'rest', travel_m: 201.5, time_s: 203, wall_s: 1.5 };
  const { word, explanation } = stands('stopping', { stops: ['held'], outlook });
  assert.equal(word, 'STOPPING');
  assert.equal(explanation, 'Hold. The head stops in 1.5 s, at 201.50 m of travel.');
  assert.match(stands('stopping', { stops: ['ending'] }).explanation, /asked to end/);
});

test("the guard's situations have different texts", () => {
  const at = (guard, more = {}) => stands('held', { guard, stops: ['guard_limit'], ...more }).explanation;
  const texts = [
    at({ kind: 'waiting' }),
    at({ kind: 'at_end', for_good: true }),
    at({ kind: 'at_end', for_good: false }, { timecode: 'locked' }),
    at({ kind: 'missing' }),
  ];
  assert.equal(new Set(texts).size, 4);
  assert.match(texts[0], /proving the travel ahead/);
  assert.match(texts[1], /permanently/);
  assert.doesNotMatch(texts[2], /permanently/);
  assert.match(texts[3], /^NO GUARD/);
});

test('a hold at the end of the grants has both texts', () => {
  const { explanation } = stands('held', { guard: { kind: 'missing' }, stops: ['held', 'guard_limit'] });
  assert.match(explanation, /release lifts it.*NO GUARD/);
  assert.equal(stands('held', { stops: ['held'] }).explanation, 'Safety stop: only a release lifts it.');
});

test('a show that stands still with its timecode is not paused by the operator', () => {
  const paused = (stops, timecode) => stands('paused', { stops, timecode }).explanation;
  assert.match(paused(['paused'], 'none'), /operator/);
  assert.match(paused(['timecode'], 'standing'), /timecode stands still/);
  assert.match(paused(['timecode'], 'waiting'), /first timecode/);
});

test('without a server no command is possible, and with a silent one a hold is', () => {
  assert.equal(obstacle(OPEN, show('running')), null);
  assert.equal(obstacle(OPEN, show('running', { link: { ...LIVE, state: 'silent' } })), null);
  assert.equal(obstacle(OPEN, show('running', { link: GONE })), 'There is no server.');
  assert.equal(obstacle(OPEN, show('ended')), 'The server has ended.');
  assert.equal(obstacle({ ...OPEN, state: 'lost' }, show('running')), 'There is no connection to the view.');
});

test('a button undoes the newest frame’s state, before the status has it', () => {
  assert.deepEqual(operatorsStops(show('paused')), { isPaused: true, isHeld: false });
  assert.deepEqual(operatorsStops(show('paused', { stops: ['timecode'] })), { isPaused: false, isHeld: false });
  assert.deepEqual(operatorsStops(show('held')), { isPaused: false, isHeld: true });
  assert.deepEqual(operatorsStops(show('running', { stops: ['held'] })), { isPaused: false, isHeld: false });
  assert.deepEqual(operatorsStops(show('stopping', { stops: ['held'] })), { isPaused: false, isHeld: true });
  const later = { ...show('held', { stops: ['paused'] }), state_tick: 10 };
  assert.deepEqual(operatorsStops(later), { isPaused: false, isHeld: true });
  const guarded = show('held', { guard: { kind: 'at_end', for_good: true }, stops: ['guard_limit'] });
  assert.deepEqual(operatorsStops(guarded), { isPaused: false, isHeld: false });
});
