// Tests of the placement of the timeline's flags.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { placeFlags } from '../../../src/display/view/page/flags.js';

const WIDTH = 400;

/** Fails if two flags overlap or one is outside the picture. */
function assertApart(flags, places) {
  const boxes = places.map((place, at) => place && { ...place, right: place.left + flags[at].wide }).filter(Boolean);
  for (const [at, box] of boxes.entries()) {
    assert.ok(box.left >= 0 && box.right <= WIDTH, JSON.stringify(box));
    for (const other of boxes.slice(at + 1)) {
      assert.ok(box.row !== other.row || box.right <= other.left || other.right <= box.left, JSON.stringify([box, other]));
    }
  }
}

test('the flags of now and the contact never overlap', () => {
  for (let now = 0; now <= WIDTH; now += 7) {
    for (let contact = 0; contact <= WIDTH; contact += 7) {
      const flags = [
        { x: now, wide: 80, isNeeded: true },
        { x: contact, wide: 100, isNeeded: true },
      ];
      const places = placeFlags(flags, WIDTH, 2);
      assert.ok(!places.includes(null), `now at ${now}, contact at ${contact}`);
      assertApart(flags, places);
    }
  }
});

test('of many near misses, the first ones with room get a flag', () => {
  const flags = Array.from({ length: 30 }, (_, at) => ({ x: 200 + at, wide: 50 }));
  const places = placeFlags(flags, WIDTH, 2);
  assert.notEqual(places[0], null);
  assert.ok(places.includes(null));
  assertApart(flags, places);
});

test('a flag is beside its line', () => {
  assert.deepEqual(placeFlags([{ x: 100, wide: 50 }], WIDTH, 2), [{ left: 99, row: 0 }]);
  assert.deepEqual(placeFlags([{ x: 390, wide: 50 }], WIDTH, 2), [{ left: 341, row: 0 }]);
});
