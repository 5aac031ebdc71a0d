// Tests of the place of the nearest pair's label.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { labelPlace } from '../../../src/display/view/page/label_place.js';

const SCREEN = { width: 800, height: 400 };
const SIZE = { wide: 96, high: 28 };
const RADIUS = 13;

const areApart = (a, b) =>
  a.left + a.wide <= b.left || b.left + b.wide <= a.left || a.top + a.high <= b.top || b.top + b.high <= a.top;

test('the label covers neither its ring, nor the head, nor the scale, anywhere on the screen', () => {
  const scale = { left: 18, top: 358, wide: 130, high: 24 };
  let tried = 0;
  for (let x = 0; x <= SCREEN.width; x += 20) {
    for (let y = 0; y <= SCREEN.height; y += 20) {
      for (let turn = 0; turn < 8; turn += 1) {
        const [dx, dy] = [Math.cos((turn * Math.PI) / 4) * 30, Math.sin((turn * Math.PI) / 4) * 30];
        const head = { left: x + dx - 13, top: y + dy - 13, wide: 26, high: 26 };
        const { place } = labelPlace({ x, y, radius: RADIUS }, SIZE, SCREEN, [head, scale]);
        const ring = { left: x - RADIUS, top: y - RADIUS, wide: 2 * RADIUS, high: 2 * RADIUS };
        for (const other of [ring, head, scale]) assert.ok(areApart(place, other), `${JSON.stringify({ x, y, turn, place })}`);
        assert.ok(place.left >= 0 && place.left + place.wide <= SCREEN.width, 'the label is cut off');
        assert.ok(place.top >= 0 && place.top + place.high <= SCREEN.height, 'the label is cut off');
        tried += 1;
      }
    }
  }
  assert.equal(tried, 41 * 21 * 8);
});

test('a free label stands above at the right', () => {
  const { place, side } = labelPlace({ x: 400, y: 200, radius: RADIUS }, SIZE, SCREEN, []);
  assert.ok(place.left > 400 && place.top < 200);
  assert.deepEqual(side, { x: 1, y: -1 });
});
