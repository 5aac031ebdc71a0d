// @ts-check
// Words of the bus. Generated from the Rust crate by its test `wire`; not changed by hand.

/** States of a frame, by their numbers. */
export const STATES = /** @type {const} */ (['running', 'paused', 'held', 'finished', 'stopping', 'ended', 'ready', 'waiting']);

/** @typedef {'danger' | 'caution' | 'calm'} Severity urgency of an alert */
/** Kinds of alerts, the most urgent first. @type {ReadonlyMap<string, Severity>} */
export const SEVERITIES = new Map([
  ['contact', 'danger'],
  ['held', 'danger'],
  ['fault', 'danger'],
  ['keep_out', 'danger'],
  ['near', 'caution'],
  ['outside', 'caution'],
  ['too_near', 'caution'],
  ['parted', 'calm'],
  ['restarted', 'calm'],
  ['inside', 'calm'],
  ['clear', 'calm'],
]);
