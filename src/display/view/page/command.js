// @ts-check
// Commands to the server, through the view.

import { tokenHeaders } from './token.js';

/** @typedef {{command: 'pause' | 'resume' | 'hold' | 'release' | 'go'} | {command: 'speed' | 'seek' | 'pace', value: number}} Command */
/** @typedef {{isAccepted: boolean, text: string}} Reply */

/** Timeout for the view's answer. The view itself waits five seconds, or ten if it must send the command again. */
const ANSWER_WITHIN_MS = 12_000;
const DONE = {
  pause: 'paused',
  resume: 'resumed',
  hold: 'held',
  release: 'released',
  speed: 'new speed',
  seek: 'new show time',
  pace: 'new pace',
  go: 'GO',
};
/** Statuses with which the view refuses a command before it sends it to the server. */
const REFUSED = new Set([400, 401, 403, 413, 415]);
/** Status with which the view reports that the server has not answered. */
const NO_ANSWER = 504;

/**
 * @param {Command} command
 * @param {string} token
 * @returns {Promise<Reply>}
 */
export async function sendCommand(command, token) {
  const name = command.command;
  try {
    const response = await fetch('command', {
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
    return not(`${name}: no answer from the view; the command may have been accepted`);
  }
}

/** @param {string} text @returns {Reply} */
function not(text) {
  return { isAccepted: false, text };
}
