// @ts-check
// Commands to the server, through the view.

import { tokenHeaders } from './token.js';

/** @typedef {{command: 'pause' | 'resume' | 'hold' | 'release'} | {command: 'speed' | 'seek', value: number}} Command */
/** @typedef {{isAccepted: boolean, text: string}} Reply */

/** The view waits five seconds for the server, and twice that where a hold has to be proven; it is to speak first. */
const ANSWER_WITHIN_MS = 12_000;
const DONE = {
  pause: 'paused',
  resume: 'resumed',
  hold: 'held',
  release: 'released',
  speed: 'new speed',
  seek: 'put there',
};
/** Statuses with which the view has refused a command before the server heard of it. */
const REFUSED = new Set([400, 401, 403, 413, 415]);
/** The view has asked, and the server has said nothing. */
const NO_ANSWER = 504;

/**
 * @param {Command} command
 * @param {string} token
 * @returns {Promise<Reply>}
 */
export async function sendCommand(command, token) {
  const name = command.command;
  try {
    const response = await fetch('/command', {
      method: 'POST',
      headers: { ...tokenHeaders(token), 'Content-Type': 'application/json' },
      body: JSON.stringify(command),
      signal: AbortSignal.timeout(ANSWER_WITHIN_MS),
    });
    const reply = await response.json();
    if (reply.accepted === true) return { isAccepted: true, text: `${DONE[name]} from tick ${reply.tick}` };
    if (reply.accepted === false) return not(`${name} refused: ${reply.reason}`);
    if (REFUSED.has(response.status)) return not(`${name} refused: ${reply.error}`);
    return not(response.status === NO_ANSWER ? `${name}: no answer: ${reply.error}` : `${name}: ${reply.error}`);
  } catch {
    return not(`${name}: no answer from the view; it may have been taken`);
  }
}

/** @param {string} text @returns {Reply} */
function not(text) {
  return { isAccepted: false, text };
}
