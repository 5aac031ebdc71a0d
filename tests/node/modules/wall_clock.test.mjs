// Tests of the wall clock.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { WallClock } from '../../../src/display/view/page/wall_clock.js';

const NINE_MS = 9 * 3_600_000;

test('the clock goes on while nothing arrives, also over midnight', () => {
  const clock = new WallClock();
  assert.equal(clock.text(0), '–');
  clock.set(NINE_MS, 500);
  assert.equal(clock.text(500), '09:00:00');
  assert.equal(clock.text(65_500), '09:01:05');
  clock.set(86_399_000, 1000);
  assert.equal(clock.text(3000), '00:00:01');
  clock.set(1500, 3500);
  assert.equal(clock.text(3500), '00:00:01', 'a reading after midnight');
});

test('readings that the network delays do not set the clock back, and a clock that was set is followed', () => {
  const clock = new WallClock();
  clock.set(NINE_MS, 0);
  // Readings of the same instants, which arrive 4.7 s late.
  for (let at_ms = 200; at_ms <= 10_000; at_ms += 200) clock.set(NINE_MS + at_ms, at_ms + 4700);
  assert.equal(clock.text(14_990), '09:00:14');
  clock.set(NINE_MS - 3_600_000, 20_000);
  assert.equal(clock.text(20_000), '08:00:00');
  clock.set(NINE_MS, 20_000);
  assert.equal(clock.text(20_000), '09:00:00');
});
