// Tests of the age of the picture, with a view whose clock is ahead of the page's, and a network that delays.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { PictureAge } from '../../../src/display/view/page/picture_age.js';

const LEAD_MS = 5_000_000;

/** Acknowledges a frame at an instant; the acknowledgement takes `way_ms`, and its report arrives later. */
function measure(age, sequence, now_ms, way_ms) {
  age.sent(sequence, now_ms);
  age.heard({ sequence, at_ms: now_ms + way_ms + LEAD_MS }, now_ms + way_ms + 200);
}

test('before the first report the age is unknown', () => {
  const age = new PictureAge();
  age.sent(1, 100);
  assert.equal(age.of(LEAD_MS, 100), null);
  age.heard(null, 100);
  age.heard({ sequence: 9, at_ms: 0 }, 100);
  assert.equal(age.of(LEAD_MS, 100), null, 'an acknowledgement that the page has not sent');
});

test('a picture that was delayed by the network is as old as its way was long', () => {
  const age = new PictureAge();
  measure(age, 1, 1000, 5);
  // Due at 2000 on the page's clock, and shown at 6700.
  assert.ok(Math.abs(age.of(2000 + LEAD_MS, 6700) - 4.705) < 1e-9);
  assert.ok(age.of(2000 + LEAD_MS, 2020) < 0.03);
  measure(age, 2, 3000, 900);
  assert.ok(age.of(4000 + LEAD_MS, 4020) < 0.03, 'the fastest acknowledgement counts');
});

test('the age is never too small, and old measurements lapse as the clocks drift apart', () => {
  const age = new PictureAge();
  measure(age, 1, 0, 5);
  // The view's clock gains a second; the measurements of the last minute know it.
  for (let at = 1; at <= 14; at += 1) {
    age.sent(at + 1, at * 10_000);
    age.heard({ sequence: at + 1, at_ms: at * 10_000 + 1005 + LEAD_MS }, at * 10_000 + 200);
  }
  assert.ok(age.of(150_000 + 1000 + LEAD_MS, 150_000) >= 0.005);
});

test('another view has another clock', () => {
  const age = new PictureAge();
  measure(age, 1, 0, 5);
  age.restart();
  assert.equal(age.of(LEAD_MS, 100), null);
});
