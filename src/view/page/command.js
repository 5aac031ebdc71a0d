// @ts-check
// Commands to the server, through the view.

/** @typedef {{command: 'pause' | 'resume' | 'hold' | 'release'} | {command: 'speed' | 'seek', value: number}} Command */
/** @typedef {{isAccepted: boolean, text: string}} Reply */

const ANSWER_WITHIN_MS = 10_000;
const DONE = {
  pause: 'paused',
  resume: 'resumed',
  hold: 'held',
  release: 'released',
  speed: 'new speed',
  seek: 'put there',
};

/**
 * @param {Command} command
 * @param {string} token
 * @returns {Promise<Reply>}
 */
export async function sendCommand(command, token) {
  try {
    const response = await fetch('/command', {
      method: 'POST',
      headers: { Authorization: `Bearer ${token}`, 'Content-Type': 'application/json' },
      body: JSON.stringify(command),
      signal: AbortSignal.timeout(ANSWER_WITHIN_MS),
    });
    const reply = await response.json();
    if (reply.accepted === true) return { isAccepted: true, text: `${DONE[command.command]} from tick ${reply.tick}` };
    return { isAccepted: false, text: `${command.command} refused: ${reply.reason ?? reply.error}` };
  } catch {
    return { isAccepted: false, text: `${command.command}: no answer from the view; it may have been taken` };
  }
}
