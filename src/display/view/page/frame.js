// @ts-check
// The binary form of a frame, little-endian. The handles are read in the machine's byte order: every machine with a browser is
// little-endian.

import { STATES } from './words.js';

/** Kinds of messages: a frame of one dragon, and of a formation. One more for those with heights. */
const ONE_DRAGON = 1;
const FORMATION = 3;
const HEADER_LENGTH = 104;
const DRAGON_LENGTH = 32;
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
 * @typedef {object} DragonMotion a dragon of the frame
 * @property {number} first_bench
 * @property {number} first_handle
 * @property {number} benches
 * @property {number} travel_m
 * @property {number} speed_mps
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
 * @property {readonly DragonMotion[]} dragons the leading dragon first
 * @property {boolean} isFormation
 * @property {Float32Array} handles x, y and speed of each handle, dragon after dragon; a dragon has one handle more than benches
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
  const state = STATES[word(12)];
  const kind = word(0);
  if (state === undefined || kind < ONE_DRAGON || kind > FORMATION + 1) return null;
  const isFormation = kind >= FORMATION;
  const hasHeights = kind === ONE_DRAGON + 1 || kind === FORMATION + 1;
  const dragons = isFormation ? readDragons(view) : [lone(benches, value(40), value(48))];
  const begin = HEADER_LENGTH + (isFormation ? 8 + dragons.length * DRAGON_LENGTH : 0);
  const handles = benches + dragons.length;
  const values = handles * VALUES_PER_HANDLE;
  if (dragons.length === 0 || message.byteLength !== begin + (values + (hasHeights ? handles : 0)) * 4) return null;
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
    dragons,
    isFormation,
    handles: new Float32Array(message, begin, values),
    heights: hasHeights ? new Float32Array(message, begin + values * 4, handles) : null,
  };
}

/** @param {number} benches @param {number} travel_m @param {number} speed_mps @returns {DragonMotion} */
function lone(benches, travel_m, speed_mps) {
  return { first_bench: 0, first_handle: 0, benches, travel_m, speed_mps };
}

/** The dragons of a formation; none if the message is too short for them. @param {DataView} view @returns {DragonMotion[]} */
function readDragons(view) {
  if (view.byteLength < HEADER_LENGTH + 8) return [];
  const count = view.getUint32(HEADER_LENGTH, true);
  if (view.byteLength < HEADER_LENGTH + 8 + count * DRAGON_LENGTH) return [];
  return Array.from({ length: count }, (_, number) => {
    const at = HEADER_LENGTH + 8 + number * DRAGON_LENGTH;
    const first_handle = view.getUint32(at + 16, true);
    return {
      // Each dragon before has one handle more than benches.
      first_bench: first_handle - number,
      first_handle,
      benches: view.getUint32(at + 20, true),
      travel_m: view.getFloat64(at, true),
      speed_mps: view.getFloat64(at + 8, true),
    };
  });
}

/** The number of a bench's dragon. @param {Pick<Frame, 'dragons'>} frame @param {number} bench */
export function dragonOf({ dragons }, bench) {
  let number = dragons.length - 1;
  while (number > 0 && bench < dragons[number].first_bench) number -= 1;
  return number;
}
