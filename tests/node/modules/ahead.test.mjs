// Tests of what lies ahead, in words.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { endOf, eventsAhead, expectedEnd, leftInWords, nextInWords, restOf } from '../../../src/display/view/page/ahead.js';

const frame = (more = {}) => ({ state: 'running', time_s: 100, time_scale: 1, ...more });
const FREE = { kind: 'free', is_end: true, time_s: 442, wall_s: 342 };
const show = (outlook = FREE, more = {}) => ({ frame: frame(more), status: { outlook } });
const TIMES = {
  isComplete: true,
  curve: [
    { time_s: 0, clearance_m: 0.2 },
    { time_s: 500, clearance_m: 0.1 },
  ],
  nearMisses: [
    { time_s: 90, clearance_m: 0.01, benches: [0, 9] },
    { time_s: 165, clearance_m: 0.029, benches: [0, 10] },
  ],
  contact: { time_s: 412.5, benches: [0, 8] },
};

test('a show that catches up is expected to go on at its own pace', () => {
  // 3 s behind at a time scale of 2, it makes up in 30 s, in which it advances by 66 s.
  const catching = (behind_s, more = {}) => ({ ...show(FREE, { time_scale: 2.2, ...more }), status: { outlook: FREE, server: { behind_s } } });
  assert.equal(nextInWords({ what: 'end', time_s: 122 }, catching(3)), 'end in 0:10');
  assert.equal(nextInWords({ what: 'end', time_s: 300 }, catching(3)), 'end in 1:37');
  assert.equal(leftInWords(300, catching(3)), '1:37 left');
  assert.equal(nextInWords({ what: 'end', time_s: 320 }, catching(3, { time_scale: 2, state: 'paused' })), 'end after 1:50');
});

test('a cue is an event with its note, and one that waits has no time', () => {
  const cue = (more) => ({ name: 'the eye', note: 'lights 4', at_s: 8, waits: false, speed_mps: null, dragon: null, state: 'next', ...more });
  const first = (cues) => eventsAhead({ frame: frame(), status: { outlook: FREE, cues } }, TIMES, 442)[0];
  assert.deepEqual(first({ cues: [cue({})], next: 0, next_in_s: 20, next_time_s: 120 }), { what: 'the eye · lights 4', time_s: 120 });
  assert.equal(first({ cues: [cue({ state: 'waiting' })], next: 0, next_in_s: null, next_time_s: null }).what, 'near miss 29.0 mm');
  assert.equal(first({ cues: [cue({ state: 'reached' })], next: null, next_in_s: null, next_time_s: null }).what, 'near miss 29.0 mm');
});

test('the next event is the nearest one ahead, whoever announces it', () => {
  const first = (outlook, times = TIMES, more = {}) => eventsAhead(show(outlook, more), times, 442)[0]?.what;
  assert.equal(first(FREE), 'near miss 29.0 mm');
  assert.equal(first({ kind: 'guard_stop', time_s: 120, wall_s: 20, benches: [0, 10] }), 'guard stop');
  assert.equal(first({ kind: 'rest', time_s: 101, wall_s: 1, travel_m: 101 }), 'head stops');
  assert.equal(first(FREE, TIMES, { time_s: 170 }), 'contact');
  assert.equal(first(FREE, TIMES, { time_s: 420 }), 'end');
  assert.equal(first(FREE, TIMES, { state: 'finished' }), undefined);
  const noPlan = { curve: [], nearMisses: [], contact: null };
  assert.equal(first({ kind: 'contact', time_s: 412.5, wall_s: 312.5, benches: [0, 8] }, noPlan), 'contact');
});

test('countdowns are in wall time, and a standing head has to walk first', () => {
  const event = { what: 'near miss 29.0 mm', time_s: 165 };
  assert.equal(nextInWords(event, show(FREE)), 'near miss 29.0 mm in 1:05');
  assert.equal(nextInWords(event, show(FREE, { time_scale: 2 })), 'near miss 29.0 mm in 0:33');
  assert.equal(nextInWords(event, show(FREE, { state: 'paused' })), 'near miss 29.0 mm after 1:05');
  assert.equal(nextInWords(undefined, show(FREE)), '–');
});

test('the time left follows the plan at the present speed, and is wall time', () => {
  const run = { start_s: 0, end_s: 442 };
  assert.equal(leftInWords(endOf(run, TIMES), show(FREE)), '6:40 left');
  const begun = { ...TIMES, isComplete: false, curve: TIMES.curve.slice(0, 1) };
  assert.equal(leftInWords(endOf(run, begun), show(FREE)), '5:42 left', 'a plan that is still computed');
  assert.equal(leftInWords(endOf(run, { ...TIMES, curve: [] }), show(FREE, { time_scale: 0.1 })), '57:00 left');
  assert.equal(leftInWords(endOf(run, { ...TIMES, curve: [] }), show(FREE, { time_scale: 0.01 })), '9:30:00 left');
  assert.equal(leftInWords(endOf({ start_s: 0, end_s: 1e9 }, TIMES), show(FREE)), '');
  assert.equal(leftInWords(442, show(FREE, { state: 'ended' })), '');
});

test('nothing comes after the stop of the guard', () => {
  const here = { kind: 'guard_stop', time_s: 100, wall_s: 0, benches: null };
  assert.deepEqual(eventsAhead(show(here, { state: 'held' }), TIMES, 442), []);
});

test('no time is left where the guard has stopped the head', () => {
  const stop = { kind: 'guard_stop', time_s: 120, wall_s: 20, benches: [0, 10] };
  assert.equal(restOf(show(stop), 442), 120);
  assert.equal(restOf(show(stop, { time_s: 120 }), 442), null);
  assert.equal(restOf(show(stop), 110), 110);
  assert.equal(restOf(show(FREE), 442), 442);
});

test('the expected end follows the forecast, and an end that has passed is not shown', () => {
  assert.equal(expectedEnd(show({ ...FREE, time_s: 450 }), 442), 450);
  assert.equal(expectedEnd(show({ kind: 'rest', time_s: 101, wall_s: 1, travel_m: 101 }), 442), 442);
  assert.equal(expectedEnd(show({ kind: 'unknown' }, { time_s: 443 }), 442), null);
});
