// @ts-check
// The binary form of a frame, little-endian. The handles are read in the machine's byte order: every machine with a browser is
// little-endian.

import { STATES } from './words.js';

const LEVEL = 1;
const WITH_HEIGHTS = 2;
const HEADER_LENGTH = 104;
const VALUES_PER_HANDLE = 3;
const NO_BENCH = 0xffffffff;

/** @typedef {typeof STATES[number]} ShowState */
/**
 * @typedef {object} Nearest the two benches with the least clearance
 * @property {number} clearance_m
 * @property {[number, number]} benches
 * @property {[number, number]} point_m midway between the two
 */
/**
 * @typedef {object} Frame
 * @property {number} sequence
 * @property {number} benches number of benches, N
 * @property {ShowState} state
 * @property {number} run_id
 * @property {number} tick
 * @property {number} time_s
 * @property {number} travel_m
 * @property {number} speed_mps
 * @property {number} time_scale
 * @property {Nearest | null} nearest
 * @property {number} due_ms instant for which the frame is, on the clock of the view's machine
 * @property {Float32Array} handles x, y and speed of each of the N + 1 handles, one after another
 * @property {Float32Array | null} heights z of each handle; `null` on level ground
 */

/**
 * The frame in a message; `null` if the message is invalid.
 * @param {ArrayBuffer} message
 * @returns {Frame | null}
 */
export function readFrame(message) {
  if (message.byteLength < HEADER_LENGTH) return null;
  const view = new DataView(message);
  const word = (/** @type {number} */ at) => view.getUint32(at, true);
  const value = (/** @type {number} */ at) => view.getFloat64(at, true);
  const benches = word(8);
  const values = (benches + 1) * VALUES_PER_HANDLE;
  const state = STATES[word(12)];
  const hasHeights = word(0) === WITH_HEIGHTS;
  const all = values + (hasHeights ? benches + 1 : 0);
  const isFrame = hasHeights || word(0) === LEVEL;
  if (!isFrame || state === undefined || message.byteLength !== HEADER_LENGTH + all * 4) return null;
  return {
    sequence: word(4),
    benches,
    state,
    run_id: value(16),
    tick: value(24),
    time_s: value(32),
    travel_m: value(40),
    speed_mps: value(48),
    time_scale: value(56),
    nearest:
      word(72) === NO_BENCH
        ? null
        : { clearance_m: value(64), benches: [word(72), word(76)], point_m: [value(80), value(88)] },
    due_ms: value(96),
    handles: new Float32Array(message, HEADER_LENGTH, values),
    heights: hasHeights ? new Float32Array(message, HEADER_LENGTH + values * 4, benches + 1) : null,
  };
}
