// @ts-check
// The bar of a replay: plays and pauses it, scrubs over the span of the recording, and changes its pace.

import { sendCommand } from './command.js';
import { element, write } from './element.js';
import { minutes } from './format.js';

/** @typedef {import('./show.js').Replay} Replay */
/** @typedef {import('./command.js').Command} Command */

const PACES = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16, 32, 64];
/** Time after a seek during which the slider does not follow the status, which may be older. */
const SETTLES_MS = 700;
const WITHOUT_TOKEN = 'Only a page with the token steers the replay.';

const bar = element('replay-bar', HTMLElement);
const play = element('replay-play', HTMLButtonElement);
const slider = element('replay-position', HTMLInputElement);
const paces = element('replay-pace', HTMLSelectElement);

export class ReplayBar {
  /** @type {string | null} */ #token;
  #mayControl = false;
  #isPaused = false;
  #sought_ms = -Infinity;
  /** The position to seek next, while a seek is on its way. @type {number | null} */ #waiting_s = null;
  #isSeeking = false;

  /** @param {string | null} token */
  constructor(token) {
    this.#token = token;
    offer(1);
    play.addEventListener('click', () => void this.#send({ command: this.#isPaused ? 'resume' : 'pause' }));
    slider.addEventListener('input', () => void this.#seek(slider.valueAsNumber));
    paces.addEventListener('change', () => void this.#send({ command: 'pace', value: Number(paces.value) }));
  }

  /** @param {string} token */
  useToken(token) {
    this.#token = token;
  }

  /** @param {import('./connection.js').Access} access */
  allow(access) {
    this.#mayControl = access.may_control && !access.read_only && this.#token !== null;
  }

  /**
   * Shows the position of the replay, or hides the bar for any other source.
   * @param {import('./show.js').Status | null} status
   * @param {number} status_ms time of its arrival, on the page's clock
   * @param {number} now_ms
   * @param {string | null} obstacle the reason for which no command can reach the replay; `null` if one can
   */
  write(status, status_ms, now_ms, obstacle) {
    const replay = status?.replay ?? null;
    bar.hidden = replay === null;
    document.body.classList.toggle('is-replay', replay !== null);
    if (replay === null) return;
    this.#isPaused = replay.paused;
    write(play, replay.paused ? 'Play' : 'Pause');
    const lacks = this.#mayControl ? obstacle : WITHOUT_TOKEN;
    for (const control of [play, slider, paces]) {
      if (control.disabled !== (lacks !== null)) control.disabled = lacks !== null;
      if (control.title !== (lacks ?? '')) control.title = lacks ?? '';
    }
    if (Number(slider.max) !== replay.length_s) slider.max = String(replay.length_s);
    const isSettled = !this.#isSeeking && now_ms - this.#sought_ms > SETTLES_MS;
    if (isSettled) slider.value = String(positionNow(replay, obstacle === null ? now_ms - status_ms : 0));
    this.#describe(slider.valueAsNumber, replay);
    if (document.activeElement !== paces) offer(replay.pace);
  }

  /** @param {number} position_s @param {Replay} replay */
  #describe(position_s, replay) {
    const time = `${minutes(position_s)} / ${minutes(replay.length_s)}`;
    write(element('replay-time', HTMLElement), replay.at_end ? `${time}, at the end` : time);
    const recorded = new Date(replay.recorded_ms);
    write(element('replay-clock', HTMLElement), `recorded ${recorded.toLocaleTimeString('en-GB')}`);
    slider.setAttribute('aria-valuetext', `${position_s.toFixed(1)} of ${replay.length_s.toFixed(1)} seconds`);
  }

  /** Seeks. While a seek is on its way, only the newest position waits. @param {number} position_s */
  async #seek(position_s) {
    this.#sought_ms = performance.now();
    this.#waiting_s = position_s;
    if (this.#isSeeking) return;
    this.#isSeeking = true;
    while (this.#waiting_s !== null) {
      const value = this.#waiting_s;
      this.#waiting_s = null;
      await this.#send({ command: 'seek', value });
    }
    this.#isSeeking = false;
    this.#sought_ms = performance.now();
  }

  /** Sends a command, and shows the reason if it fails. @param {Command} command */
  async #send(command) {
    if (!this.#mayControl || this.#token === null) return;
    const { isAccepted, text } = await sendCommand(command, this.#token);
    write(element('replay-reply', HTMLElement), isAccepted ? '' : text);
  }
}

/**
 * The position of a replay some time after its status.
 * @param {Replay} replay
 * @param {number} age_ms
 */
function positionNow({ position_s, length_s, pace, paused, at_end }, age_ms) {
  const walked_s = paused || at_end ? 0 : (age_ms / 1e3) * pace;
  return Math.min(position_s + walked_s, length_s);
}

/** Offers the paces, and this one. @param {number} pace */
function offer(pace) {
  const offered = PACES.includes(pace) ? PACES : [...PACES, pace].sort((a, b) => a - b);
  if (paces.dataset.offered !== offered.join()) {
    paces.dataset.offered = offered.join();
    paces.replaceChildren(...offered.map((factor) => new Option(`${factor}×`, String(factor))));
  }
  if (paces.value !== String(pace)) paces.value = String(pace);
}
