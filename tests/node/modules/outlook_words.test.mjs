// Tests of the forecast in words.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { outlookInWords } from '../../../src/display/view/page/outlook_words.js';

test('the countdown to a contact is in wall time, with show time beside it', () => {
  // 3.7 s of show time, at a time scale of 5.
  const outlook = { kind: 'contact', benches: [0, 8], travel_m: 412.47, time_s: 412.474, wall_s: 0.74 };
  const { large, small, level } = outlookInWords(outlook, 'running');
  assert.equal(large, 'Contact in 0.7 s');
  assert.equal(small, 'benches 0 and 8, at show time 412.474 s');
  assert.equal(level, 'now');
  assert.equal(outlookInWords(outlook, 'paused').large, 'Contact after 0.7 s of walking');
});

test('the earliest contact that loose hinges allow is beside the contact', () => {
  const outlook = { kind: 'contact', benches: [0, 8], travel_m: 412.47, time_s: 412.474, wall_s: 0.74 };
  const { small } = outlookInWords(outlook, 'running', { travel_m: 405.665, time_s: 405.665, wall_s: 0 });
  assert.match(small, /show time 412\.474 s; with play in the hinges possible from 405\.665 s$/);
});

test('before a stop by the guard, no contact is announced', () => {
  const outlook = { kind: 'guard_stop', benches: [0, 8], travel_m: 409, time_s: 409.5, wall_s: 8 };
  const { large, small, level } = outlookInWords(outlook, 'running');
  assert.equal(large, 'Guard stops the head in 8.0 s');
  assert.equal(small, 'before benches 0 and 8 come too near, at show time 409.500 s');
  assert.notEqual(level, 'now');
  assert.match(outlookInWords({ ...outlook, benches: null }, 'running').small, /^no guard runs/);
  assert.equal(outlookInWords({ ...outlook, wall_s: 0 }, 'held').large, 'The guard stops the head here');
});

test('a braking head has a stop ahead and no urgency', () => {
  const outlook = { kind: 'rest', travel_m: 201.5, time_s: 203, wall_s: 1.5 };
  const { large, level } = outlookInWords(outlook, 'stopping');
  assert.deepEqual([large, level], ['Head stops in 1.5 s', 'far']);
});

test('a show that is over has no forecast', () => {
  for (const state of ['finished', 'ended']) {
    const outlook = { kind: 'contact', benches: [0, 8], travel_m: 412, time_s: 412, wall_s: 1 };
    assert.deepEqual(outlookInWords(outlook, state), { large: '–', small: 'the show is over', level: 'far' });
  }
});
