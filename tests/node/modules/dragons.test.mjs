// Tests of frames and words of several dragons.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { board, benchAt } from '../../../src/display/view/page/boards.js';
import { pair } from '../../../src/display/view/page/format.js';
import { dragonOf, readFrame } from '../../../src/display/view/page/frame.js';
import { endOf } from '../../../src/display/view/page/ahead.js';
import { timesOfFormation } from '../../../src/display/view/page/plan_times.js';
import { outlookInWords } from '../../../src/display/view/page/outlook_words.js';
import { overlapping } from '../../../src/display/view/page/overlap.js';
import { namesOf } from '../../../src/display/view/page/show.js';

const RUN = {
  dragons: [
    { name: 'gold', first_bench: 0, first_handle: 0, hole_offset_m: 0.25, width_m: 0.3 },
    { name: 'silver', first_bench: 2, first_handle: 3, hole_offset_m: 0.5, width_m: 0.4 },
  ],
};

/** A message of two dragons of two benches each: gold on the x axis, silver 1 m above and 10 m further. */
function message() {
  const bytes = new ArrayBuffer(104 + 8 + 2 * 32 + 6 * 12);
  const view = new DataView(bytes);
  [3, 7, 4, 0].forEach((word, at) => view.setUint32(4 * at, word, true));
  view.setUint32(72, 0xffffffff, true);
  view.setUint32(104, 2, true);
  [0, 1].forEach((number) => {
    const at = 112 + 32 * number;
    view.setFloat64(at, 5 + number, true);
    view.setFloat64(at + 8, 1 - number, true);
    [3 * number, 2, 1].forEach((word, word_at) => view.setUint32(at + 16 + 4 * word_at, word, true));
  });
  const places = [[4, 0], [2, 0], [0, 0], [14, 1], [12, 1], [10, 1]];
  places.forEach(([x, y], at) => {
    view.setFloat32(176 + 12 * at, x, true);
    view.setFloat32(180 + 12 * at, y, true);
  });
  return bytes;
}

test('a frame of a formation has its dragons, and no board lies between two of them', () => {
  const frame = readFrame(message());
  assert.deepEqual(frame.dragons, [
    { first_bench: 0, first_handle: 0, benches: 2, travel_m: 5, speed_mps: 1 },
    { first_bench: 2, first_handle: 3, benches: 2, travel_m: 6, speed_mps: 0 },
  ]);
  assert.deepEqual([0, 1, 2, 3].map((bench) => dragonOf(frame, bench)), [0, 0, 1, 1]);
  const boards = [0, 1, 2, 3].map((bench) => board(frame, RUN, bench));
  assert.deepEqual(boards.map(({ x, y }) => [x, y]), [[3, 0], [1, 0], [13, 1], [11, 1]]);
  assert.deepEqual(boards.map(({ halfLength_m }) => halfLength_m), [1.25, 1.25, 1.5, 1.5]);
  assert.equal(benchAt(frame, RUN, [11, 1], 0.1), 3);
  assert.equal(benchAt(frame, RUN, [7, 0.5], 0.1), null);
});

test('at half the pace, the rest of the show takes twice as long', () => {
  // Plan time 20 s of 100 s, at 1.25 m/s planned and 0.625 m/s now.
  const clock = { travel_m: 25, time_s: 30, speed_mps: 0.625 };
  const run = { start_s: 0, end_s: 100, planned_speed_mps: 1.25 };
  assert.equal(endOf(run, timesOfFormation(null, clock, run)), 30 + 160);
  // Of the plan, what is ahead is known.
  const plan = { curve: [0, 0.9, 25, 0.5, 125, 0.25], near_misses: [], near_misses_dropped: 0, contact: null, is_complete: true };
  const times = timesOfFormation(plan, clock, run);
  assert.deepEqual(times.curve, [{ time_s: 30, clearance_m: 0.5 }, { time_s: 190, clearance_m: 0.25 }]);
  assert.equal(times.end_s, 190);
});

test('a shorter or longer message is no frame', () => {
  const whole = message();
  for (let length = 0; length < whole.byteLength; length += 4) assert.equal(readFrame(whole.slice(0, length)), null);
  assert.equal(readFrame(new Uint8Array([...new Uint8Array(whole), 0, 0, 0, 0]).buffer), null);
});

test('the last bench of a dragon and the first one of the next are no neighbours', () => {
  const bytes = message();
  const view = new DataView(bytes);
  // The head of silver stands on the tail of gold.
  [0.5, -1.5, -3.5].forEach((x, at) => {
    view.setFloat32(176 + 12 * (3 + at), x, true);
    view.setFloat32(180 + 12 * (3 + at), 0, true);
  });
  assert.deepEqual([...overlapping(readFrame(bytes), RUN)].sort(), [1, 2]);
});

test('pairs of several dragons have their names', () => {
  assert.equal(pair({ benches: [1, 2], ...namesOf([1, 2], RUN) }), 'gold 1 and silver 0');
  assert.equal(pair({ benches: [1, 2], ...namesOf([1, 2], null) }), 'benches 1 and 2');
});

test('the guard stops the show of several dragons, before the two by their names', () => {
  const outlook = { kind: 'guard_stop', benches: [1, 2], dragons: ['gold', 'silver'], indices: [1, 0], travel_m: 9, time_s: 9.5, wall_s: 8 };
  const { large, small } = outlookInWords(outlook, 'running', null, true);
  assert.equal(large, 'Guard stops the show in 8.0 s');
  assert.equal(small, 'before gold 1 and silver 0 come too near, at show time 9.500 s');
  const rest = outlookInWords({ kind: 'rest', travel_m: 9, time_s: 9.5, wall_s: 8 }, 'stopping', null, true);
  assert.equal(`${rest.large}, ${rest.small}`, 'Show stops in 8.0 s, at show time 9.50 s');
});
