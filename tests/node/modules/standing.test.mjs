// Tests of the state of the show in words.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { obstacle, operatorsStops, standing } from '../../../src/display/view/page/standing.js';

const OPEN = { state: 'open', heard_ms: 0, reason: null, outcome: null };
const LIVE = { state: 'live', age_s: null, reason: null };
const GONE = { state: 'gone', age_s: 2, reason: null };

/** How the view says that the show stands. */
const SAID = { level: 'good', word: 'RUNNING', cause: 'The dragon walks.', remedy: null };

function show(state, { link = LIVE, guard = { kind: 'none' }, stops = [], standing: said = SAID } = {}) {
  const server = { tick: 9, stops, timecode: 'none', source: 'server' };
  return {
    frame: { state, benches: 223, time_scale: 1 },
    status: { link, guard, standing: said, server },
    state_tick: 9,
  };
}

const FRESH_S = 0.02;
const stands = (state, situation, age_s = FRESH_S) => standing(OPEN, show(state, situation), 0, age_s);

test('an orderly end is no alarm, with or without a server process', () => {
  for (const link of [LIVE, GONE]) {
    const { status, word, isLive } = stands('ended', { link });
    assert.deepEqual([status, word, isLive], ['ended', 'ENDED', true]);
  }
  assert.equal(standing({ ...OPEN, state: 'ended' }, show('running'), 0, FRESH_S).word, 'VIEW ENDED');
});

test('each end of a show has its word and its sentence, also after the view has ended', () => {
  for (const state of ['open', 'ended', 'lost']) {
    const end = (kind) => standing({ ...OPEN, state, outcome: { kind, text: `It was ${kind}.` } }, show('held'), 0, FRESH_S);
    const words = ['failed', 'guard', 'contact', 'end_of_run', 'stopped'].map((kind) => end(kind).word);
    assert.deepEqual(words, ['SHOW FAILED', 'GUARD STOP', 'CONTACT', 'SHOW ENDED', 'SHOW ENDED']);
    assert.equal(end('failed').isLive, false);
    assert.match(end('guard').explanation, /^It was guard/);
  }
});

test('without a server no command is possible, and with a silent one a hold is', () => {
  assert.equal(obstacle(OPEN, show('running')), null);
  assert.equal(obstacle(OPEN, show('running', { link: { ...LIVE, state: 'silent' } })), null);
  assert.equal(obstacle(OPEN, show('running', { link: GONE })), 'There is no server.');
  assert.equal(obstacle(OPEN, show('ended')), 'The server has ended.');
  assert.equal(obstacle({ ...OPEN, state: 'lost' }, show('running')), 'There is no connection to the view.');
});

test('a button undoes the newest frame’s state, before the status has it', () => {
  assert.deepEqual(operatorsStops(show('paused')), { isPaused: true, isHeld: false, isReady: false });
  assert.deepEqual(operatorsStops(show('paused', { stops: ['timecode'] })), { isPaused: false, isHeld: false, isReady: false });
  assert.deepEqual(operatorsStops(show('held')), { isPaused: false, isHeld: true, isReady: false });
  assert.deepEqual(operatorsStops(show('running', { stops: ['held'] })), { isPaused: false, isHeld: false, isReady: false });
  assert.deepEqual(operatorsStops(show('stopping', { stops: ['held'] })), { isPaused: false, isHeld: true, isReady: false });
  const later = { ...show('held', { stops: ['paused'] }), state_tick: 10 };
  assert.deepEqual(operatorsStops(later), { isPaused: false, isHeld: true, isReady: false });
  const guarded = show('held', { guard: { kind: 'at_end', for_good: true }, stops: ['guard_limit'] });
  assert.deepEqual(operatorsStops(guarded), { isPaused: false, isHeld: false, isReady: false });
});

test('a show that waits at its start is ready, and a release starts it', () => {
  assert.deepEqual([stands('ready').status, stands('ready').word], ['ready', 'READY']);
  assert.deepEqual(operatorsStops(show('ready', { stops: ['ready'] })), { isPaused: false, isHeld: false, isReady: true });
});

test("a live show has the view's sentences and level, unless they belong to another state", () => {
  const held = { level: 'danger', word: 'HELD', cause: 'An operator holds the show for safety.', remedy: 'A release lifts the hold.' };
  const shown = stands('held', { standing: held });
  assert.deepEqual([shown.level, shown.explanation, shown.remedy], [held.level, held.cause, held.remedy]);
  assert.equal(stands('running', { standing: held }).explanation, '', 'the frame is newer than the sentences');
  assert.equal(stands('running').explanation, 'The dragon walks.');
});

test('an old picture has its age instead of the colour of its state, and a state without an age is not shown', () => {
  const old = stands('running', {}, 4.71);
  assert.deepEqual([old.status, old.isLive, old.isLost], ['old', false, true]);
  assert.match(old.explanation, /^Picture 4\.7 s old: .* running\. Use the wired stop\.$/);
  assert.equal(stands('running', {}, 0.9).status, 'running');
  assert.deepEqual([stands('running', {}, null).status, stands('running', {}, null).isLive], ['connecting', false]);
});

test('a show whose process was killed has not ended in order', () => {
  const lost = { level: 'danger', word: 'SHOW LOST', cause: 'The process `show` was killed.', remedy: 'Start it again.' };
  const ended = stands('ended', { link: { state: 'ended', age_s: 1, reason: null }, standing: lost });
  assert.deepEqual([ended.word, ended.isLost, ended.remedy], ['SHOW LOST', true, lost.remedy]);
});

test('where nobody can tell what the dragon does, the wired stop comes before all other remedies', () => {
  const gone = { level: 'danger', word: 'SERVER LOST', cause: 'The server is gone.', remedy: 'Start it again.' };
  const silent = { state: 'silent', age_s: 2, reason: null };
  const dark = [
    stands('running', { link: GONE, standing: gone }, 4.71),
    stands('running', { link: silent, standing: { ...gone, word: 'SILENT' } }),
    stands('held', { link: { state: 'failed', age_s: null, reason: 'broken' }, standing: { ...gone, word: 'NO BUS' } }),
    standing({ ...OPEN, state: 'lost' }, show('running'), 0, FRESH_S),
  ];
  assert.deepEqual(dark.map(({ word }) => word), ['SERVER LOST', 'SILENT', 'NO BUS', 'VIEW LOST']);
  for (const { isLost, isLive, explanation } of dark) {
    assert.deepEqual([isLost, isLive], [true, false], explanation);
    assert.match(explanation, /Use the wired stop\.$/);
  }
  assert.equal(dark[0].remedy, 'Start it again.');
});
