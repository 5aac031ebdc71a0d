// @ts-check
// Numbers for people. An unknown value is a dash.

const UNKNOWN = '–';
const MINUS = '−';

/** @typedef {number | null | undefined} Maybe */

/**
 * @param {Maybe} value
 * @param {number} digits
 */
export function fixed(value, digits) {
  if (value === null || value === undefined || !Number.isFinite(value)) return UNKNOWN;
  const text = Math.abs(value).toFixed(digits);
  return value < 0 && Number(text) !== 0 ? MINUS + text : text;
}

/** @param {Maybe} seconds */
export const showTime = (seconds) => fixed(seconds, 2);

/** @param {Maybe} metres length in metres, written in millimetres */
export const millimetres = (metres) => fixed(metres === null || metres === undefined ? metres : metres * 1e3, 1);

/**
 * @typedef {object} Pair two benches. With several dragons: also their names, and the indices of the benches within them.
 * @property {readonly number[]} benches
 * @property {readonly string[]} [dragons]
 * @property {readonly number[]} [indices]
 */

/** @param {Pair} pair */
export const pair = ({ benches: [a, b], dragons, indices }) =>
  dragons === undefined || indices === undefined
    ? `benches ${a} and ${b}`
    : `${dragons[0]} ${indices[0]} and ${dragons[1]} ${indices[1]}`;

/** @param {Maybe} microseconds */
export function shortTime(microseconds) {
  if (microseconds === null || microseconds === undefined) return UNKNOWN;
  if (microseconds < 1000) return `${fixed(microseconds, 0)} µs`;
  if (microseconds < 1e6) return `${fixed(microseconds / 1e3, microseconds < 1e4 ? 1 : 0)} ms`;
  return `${fixed(microseconds / 1e6, 1)} s`;
}

/** @param {Maybe} value an integer, written in groups of three digits */
export function count(value) {
  if (value === null || value === undefined) return UNKNOWN;
  return Math.round(value)
    .toString()
    .replace(/\B(?=(\d{3})+$)/g, '\u202f');
}

/** @param {number} seconds age in seconds */
export function age(seconds) {
  if (seconds < 100) return `${fixed(seconds, 1)} s`;
  return seconds < 6000 ? `${fixed(seconds / 60, 0)} min` : `${fixed(seconds / 3600, 1)} h`;
}

/** @param {number} seconds time until something, rounded up: `0:05`, `12:41`, `1:12:41` */
export function countdown(seconds) {
  const whole = Math.ceil(Math.max(seconds, 0));
  if (whole < 3600) return minutes(whole);
  return `${Math.floor(whole / 3600)}:${minutes(whole % 3600).padStart(5, '0')}`;
}

/** @param {number} seconds time in seconds, written in minutes and seconds */
export function minutes(seconds) {
  const whole = Math.floor(Math.abs(seconds));
  return `${seconds < 0 ? MINUS : ''}${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, '0')}`;
}

/** A kind of alert as words. @param {string} kind */
export const spaced = (kind) => kind.replace('_', ' ');
