// Tests of the planned clearance over show time.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import * as format from '../../../src/display/view/page/format.js';
import { planInWords, planOverTime, plannedAt } from '../../../src/display/view/page/plan_times.js';

const run = { start_s: 0, end_s: 100 };
const plan = {
  run_id: 1,
  is_complete: true,
  curve: [0, 0.2, 50, 0.1, 60, 0.01, 80, 0, 100, -0.1],
  near_misses: [{ travel_m: 60, clearance_m: 0.01, benches: [0, 9] }],
  near_misses_dropped: 0,
  contact: { travel_m: 80, benches: [0, 8] },
};

test('at the planned speed, the plan covers the whole show', () => {
  const { curve, nearMisses, contact } = planOverTime(plan, { travel_m: 30, time_s: 30, speed_mps: 1 }, run);
  assert.deepEqual(
    curve.map(({ time_s }) => time_s),
    [0, 50, 60, 80, 100],
  );
  assert.deepEqual([nearMisses[0].time_s, contact.time_s], [60, 80]);
});

test('at half the speed, the plan ahead is later and the plan behind is left out', () => {
  const { curve, contact } = planOverTime(plan, { travel_m: 55, time_s: 55, speed_mps: 0.5 }, run);
  assert.deepEqual(
    curve.map(({ time_s }) => time_s),
    [65, 105, 145],
  );
  assert.equal(contact.time_s, 105);
});

test('between two points the plan is linear, and outside it is unknown', () => {
  const { curve } = planOverTime(plan, { travel_m: 0, time_s: 0, speed_mps: 1 }, run);
  assert.ok(Math.abs(plannedAt(curve, 25) - 0.15) < 1e-12);
  assert.ok(Math.abs(plannedAt(curve, 60) - 0.01) < 1e-12);
  assert.ok(Number.isNaN(plannedAt(curve, 101)) && Number.isNaN(plannedAt(curve, -1)));
});

test('the plan in words has its near misses and its contact', () => {
  const times = planOverTime(plan, { travel_m: 0, time_s: 0, speed_mps: 1 }, run);
  assert.equal(planInWords(plan, times, false, format), 'planned: 1 near miss 10.0 mm at 60.0 s · contact at 80.0 s');
  const none = { ...plan, near_misses: [], contact: null };
  assert.equal(planInWords(none, { ...times, nearMisses: [], contact: null }, false, format), 'planned: no contact');
});

test('after the end, the plan in words keeps what is behind the head', () => {
  const times = planOverTime(plan, { travel_m: 100, time_s: 150, speed_mps: 0.5 }, run);
  assert.equal(planInWords(plan, times, true, format), 'planned: 1 near miss 10.0 mm, passed · contact, passed');
});

test('an incomplete plan says whether it will become complete', () => {
  const [partial, times] = [{ ...plan, is_complete: false }, planOverTime(plan, { travel_m: 0, time_s: 0, speed_mps: 1 }, run)];
  assert.equal(planInWords(partial, times, false, format), 'the planner is still computing');
  assert.equal(planInWords(partial, times, true, format), 'the show ended before its plan was complete');
});
