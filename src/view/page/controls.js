// @ts-check
// What steers the show. Hold is always one press; release lifts a safety stop, so that its button asks once more.

import { sendCommand } from './command.js';
import { element, write } from './element.js';
import * as format from './format.js';

/** @typedef {import('./command.js').Command} Command */
/** @typedef {import('./connection.js').Access} Access */
/** @typedef {import('./frame.js').ShowState} ShowState */

const ASKS_FOR_MS = 5000;

const button = (/** @type {string} */ id) => element(id, HTMLButtonElement);
const input = (/** @type {string} */ id) => element(id, HTMLInputElement);
const section = element('controls', HTMLElement);
const reply = element('reply', HTMLElement);
const released = button('release');
const releaseWord = element('release-word', HTMLElement);
const pauseWord = element('pause-word', HTMLElement);
const pauseShape = element('pause-shape', SVGUseElement);
const fields = { speed: input('speed-field'), seek: input('seek-field') };

export class Controls {
  /** @type {string | null} */ #token;
  /** @type {ShowState | null} */ #state = null;
  #mayControl = false;
  #isReadOnly = false;
  #sent = 0;
  /** The number of the newest hold, and what became of it if it failed. */
  #hold = { number: 0, failure: '' };
  /** @type {number | undefined} */ #asking;

  /** @param {string | null} token */
  constructor(token) {
    this.#token = token;
    button('pause').addEventListener('click', () => this.pauseOrResume());
    button('hold').addEventListener('click', () => this.hold());
    released.addEventListener('click', () => this.#askToRelease());
    this.#offer('speed');
    this.#offer('seek');
    this.#enable();
  }

  /** @param {string} token */
  useToken(token) {
    this.#token = token;
  }

  /** @param {Access} access */
  allow(access) {
    this.#isReadOnly = access.read_only;
    this.#mayControl = access.may_control && !access.read_only && this.#token !== null;
    document.body.classList.toggle('is-read-only', access.read_only);
    if (access.read_only) section.remove();
    this.#enable();
    if (!this.#mayControl) say('To steer the show, open the address that bench-dragon view printed.', 'quiet');
    else if (reply.dataset.tone === 'quiet') say('', '');
  }

  /** The range of show time that may be sought, and the speed that is planned. @param {import('./show.js').Run} run */
  takeRun(run) {
    fields.seek.min = String(run.start_s);
    fields.seek.max = String(run.end_s);
    fields.seek.placeholder = `${format.fixed(run.start_s, 0)} to ${format.fixed(Math.floor(run.end_s), 0)}`;
    fields.speed.placeholder = String(run.planned_speed_mps);
  }

  /** @param {ShowState} state */
  takeState(state) {
    if (state === this.#state) return;
    this.#state = state;
    const isPaused = state === 'paused';
    write(pauseWord, isPaused ? 'Resume' : 'Pause');
    pauseShape.setAttribute('href', isPaused ? '#shape-running' : '#shape-paused');
    this.#stopAsking();
    released.hidden = state !== 'held';
  }

  pauseOrResume() {
    void this.#send({ command: this.#state === 'paused' ? 'resume' : 'pause' });
  }

  hold() {
    void this.#send({ command: 'hold' });
  }

  release() {
    if (this.#state === 'held') void this.#send({ command: 'release' });
  }

  /** Puts a show time into the field; it is sought when somebody says so. @param {number} time_s */
  proposeSeek(time_s) {
    if (this.#isReadOnly) return;
    // In tenths, and not beyond an end that lies between two.
    const tenths = Math.min(Math.round(time_s * 10), Math.floor(Number(fields.seek.max) * 10));
    fields.seek.value = (Math.max(tenths, Math.ceil(Number(fields.seek.min) * 10)) / 10).toFixed(1);
  }

  #enable() {
    for (const one of section.querySelectorAll('button, input')) {
      if (one instanceof HTMLButtonElement || one instanceof HTMLInputElement) one.disabled = !this.#mayControl;
    }
  }

  /** @param {'speed' | 'seek'} command */
  #offer(command) {
    element(`${command}-form`, HTMLFormElement).addEventListener('submit', (event) => {
      event.preventDefault();
      void this.#send({ command, value: fields[command].valueAsNumber });
      // So that the keys are at hand again.
      fields[command].blur();
    });
  }

  #askToRelease() {
    if (released.dataset.asks === 'true') {
      this.#stopAsking();
      return this.release();
    }
    released.dataset.asks = 'true';
    write(releaseWord, 'Press again to release');
    this.#asking = setTimeout(() => this.#stopAsking(), ASKS_FOR_MS);
  }

  #stopAsking() {
    clearTimeout(this.#asking);
    delete released.dataset.asks;
    write(releaseWord, 'Release the hold');
  }

  /** The newest command's reply is shown, and that a hold has failed whatever came after it. @param {Command} command */
  async #send(command) {
    if (!this.#mayControl || this.#token === null) return;
    const number = (this.#sent += 1);
    this.#hold.failure = '';
    if (command.command === 'hold') this.#hold.number = number;
    say(`${command.command} …`, '');
    const { isAccepted, text } = await sendCommand(command, this.#token);
    if (number === this.#hold.number && !isAccepted) {
      this.#hold.failure = text;
      say(number === this.#sent ? text : `${text} · ${reply.textContent}`, 'bad');
    } else if (number === this.#sent) {
      const { failure } = this.#hold;
      say(failure === '' ? text : `${failure} · ${text}`, isAccepted && failure === '' ? 'good' : 'bad');
    }
  }
}

/** @param {string} text @param {'good' | 'bad' | 'quiet' | ''} tone */
function say(text, tone) {
  write(reply, text);
  reply.dataset.tone = tone;
}
