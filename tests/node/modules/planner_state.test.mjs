import assert from 'node:assert/strict';
import test from 'node:test';

import { State } from '../../../src/display/planner/page/state.js';

const plan = (number) => ({
  type: 'plan',
  number,
  text: '',
  run: {},
  handles: [],
  routes: [{ name: null }],
  times_s: [0, 10],
  contact: { state: 'none' },
  pose: { time_s: 10, handles: [] },
});
const curve = (points, is_complete) => ({ type: 'curve', number: 1, points, is_complete });

test('a curve grows in parts, stays in grey after an edit, and gives way to the first part of the next', () => {
  const state = new State();
  state.take(plan(1));
  state.take(curve([0, 0.5, 1, 0.4], false));
  state.take(curve([2, 0.3], true));
  assert.deepEqual(state.samples.map(({ time_s }) => time_s), [0, 1, 2]);
  assert.ok(state.isCurveComplete && !state.isCurveOld);
  state.take(plan(2));
  assert.ok(state.isCurveOld && !state.isCurveComplete);
  assert.equal(state.samples.length, 3, 'the earlier curve is still drawn');
  state.take(curve([0, 0.9], false));
  assert.deepEqual(state.samples, [{ time_s: 0, clearance_m: 0.9 }]);
});

test('the points of a curve that come after a coarse one lie between its points', () => {
  const state = new State();
  state.take(plan(1));
  state.take(curve([0, 0.5, 2, 0.3], false));
  state.take(curve([1, 0.4, 3, 0.2], true));
  assert.deepEqual(state.samples.map(({ time_s }) => time_s), [0, 1, 2, 3]);
});

test('after a mistake the last good plan stays, and the next good text lifts the mistake', () => {
  const state = new State();
  state.take(plan(1));
  state.take({ type: 'mistake', number: 2, reason: 'line 3' });
  assert.equal(state.plan.number, 1);
  assert.equal(state.mistake, 'line 3');
  state.take(plan(3));
  assert.equal(state.mistake, null);
});

test('a plan is studied once its last answer has come', () => {
  const state = new State();
  state.take(plan(1));
  assert.ok(!state.isStudied);
  state.take({ type: 'speeds', number: 1, speeds: [{ ratio: 1.2 }] });
  assert.ok(state.isStudied);
  state.take(plan(2));
  assert.ok(!state.isStudied);
  assert.equal(state.speeds[0].ratio, 1.2, 'the earlier number is still there, in grey');
});
