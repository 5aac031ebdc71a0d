// @ts-check
// What steers the show. Hold is always one press; release lifts a safety stop, and a seek puts the dragon elsewhere, so that
// their buttons ask once more. A control that would be refused is off, and says why.

import { sendCommand } from './command.js';
import { element, write } from './element.js';
import * as format from './format.js';

/** @typedef {import('./command.js').Command} Command */
/** @typedef {import('./connection.js').Access} Access */
/** @typedef {import('./show.js').Refusals} Refusals */

const ASKS_FOR_MS = 5000;

const button = (/** @type {string} */ id) => element(id, HTMLButtonElement);
const input = (/** @type {string} */ id) => element(id, HTMLInputElement);
const section = element('controls', HTMLElement);
const reply = element('reply', HTMLElement);
const released = button('release');
const releaseWord = element('release-word', HTMLElement);
/** Kept, for a page of a read-only view takes them out. */
const [pauseButton, holdButton, speedButton, seekButton] = ['pause', 'hold', 'speed-set', 'seek-set'].map(button);
const pauseWord = element('pause-word', HTMLElement);
const pauseShape = element('pause-shape', SVGUseElement);
const WITHOUT_TOKEN = 'To steer the show, open the address that bench-dragon view printed.';
const fields = { speed: input('speed-field'), seek: input('seek-field') };

export class Controls {
  /** @type {string | null} */ #token;
  /** Whether the operator has paused the show, also while the head still brakes. */
  #isPaused = false;
  #isHeld = false;
  /** @type {Refusals | null} */ #refusals = null;
  /** Why no command gets through at all. @type {string | null} */ #obstacle = 'There is no server.';
  #mayControl = false;
  #isReadOnly = false;
  #sent = 0;
  /** The number of the newest hold, and what became of it if it failed. */
  #hold = { number: 0, failure: '' };
  /** The button that asks whether it is meant, and until when. @type {{button: HTMLButtonElement, end: number} | null} */
  #asking = null;

  /** @param {string | null} token */
  constructor(token) {
    this.#token = token;
    pauseButton.addEventListener('click', () => this.pauseOrResume());
    holdButton.addEventListener('click', () => this.hold());
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
    if (!this.#mayControl) say(WITHOUT_TOKEN, 'quiet');
    else if (reply.dataset.tone === 'quiet') say('', '');
  }

  /** The range of show time that may be sought, and the speed that is planned. @param {import('./show.js').Run} run */
  takeRun(run) {
    fields.seek.min = String(run.start_s);
    fields.seek.max = String(run.end_s);
    fields.seek.placeholder = `${format.fixed(run.start_s, 0)} to ${format.fixed(Math.floor(run.end_s), 0)}`;
    fields.speed.placeholder = String(run.planned_speed_mps);
  }

  /**
   * What each command would come to now.
   * @param {Refusals | null} refusals
   * @param {{isPaused: boolean, isHeld: boolean}} stops of the operator's
   * @param {string | null} obstacle why no command gets through at all
   */
  takeSituation(refusals, { isPaused, isHeld }, obstacle) {
    if (isPaused !== this.#isPaused) {
      write(pauseWord, isPaused ? 'Resume' : 'Pause');
      pauseShape.setAttribute('href', isPaused ? '#shape-running' : '#shape-paused');
    }
    if (isHeld !== this.#isHeld) {
      if (this.#asking?.button === released) this.#stopAsking();
      released.hidden = !isHeld;
    }
    [this.#isPaused, this.#isHeld, this.#refusals, this.#obstacle] = [isPaused, isHeld, refusals, obstacle];
    this.#enable();
  }

  pauseOrResume() {
    void this.#send({ command: this.#isPaused ? 'resume' : 'pause' });
  }

  hold() {
    void this.#send({ command: 'hold' });
  }

  release() {
    if (this.#isHeld) void this.#send({ command: 'release' });
  }

  /** Puts a show time into the field; it is sought when somebody says so. @param {number} time_s */
  proposeSeek(time_s) {
    if (this.#isReadOnly) return;
    // In tenths, and not beyond an end that lies between two.
    const tenths = Math.min(Math.round(time_s * 10), Math.floor(Number(fields.seek.max) * 10));
    fields.seek.value = (Math.max(tenths, Math.ceil(Number(fields.seek.min) * 10)) / 10).toFixed(1);
  }

  /** Why a command's button is off; a key asks the server in any case, for what the page knows may be old. @param {Command['command']} command */
  #refusal(command) {
    if (!this.#mayControl) return WITHOUT_TOKEN;
    return this.#obstacle ?? this.#refusals?.[command] ?? null;
  }

  #enable() {
    this.#switch(this.#isPaused ? 'resume' : 'pause', pauseButton);
    this.#switch('hold', holdButton);
    this.#switch('release', released);
    this.#switch('speed', fields.speed, speedButton);
    this.#switch('seek', fields.seek, seekButton);
  }

  /** @param {Command['command']} command @param {(HTMLButtonElement | HTMLInputElement)[]} controls */
  #switch(command, ...controls) {
    const refusal = this.#refusal(command);
    for (const control of controls) {
      if (control.disabled !== (refusal !== null)) control.disabled = refusal !== null;
      if (control.title !== (refusal ?? '')) control.title = refusal ?? '';
    }
  }

  /** @param {'speed' | 'seek'} command */
  #offer(command) {
    element(`${command}-form`, HTMLFormElement).addEventListener('submit', (event) => {
      event.preventDefault();
      const value = fields[command].valueAsNumber;
      if (command === 'seek' && !this.#isMeant(seekButton, 'Sure?', 'Set')) {
        return say(`Press again to seek: the dragon jumps to ${format.fixed(value, 1)} s of show time.`, '');
      }
      void this.#send({ command, value });
      // So that the keys are at hand again.
      fields[command].blur();
    });
    fields[command].addEventListener('input', () => {
      if (this.#asking?.button === seekButton) this.#stopAsking();
    });
  }

  #askToRelease() {
    if (this.#isMeant(released, 'Press again to release', 'Release the hold')) this.release();
  }

  /**
   * Whether a button is pressed for the second time; after the first time it asks.
   * @param {HTMLButtonElement} pressed
   * @param {string} question
   * @param {string} word that it has otherwise
   */
  #isMeant(pressed, question, word) {
    const isMeant = this.#asking?.button === pressed;
    this.#stopAsking();
    if (isMeant) return true;
    pressed.dataset.asks = 'true';
    pressed.dataset.word = word;
    write(wordOf(pressed), question);
    this.#asking = { button: pressed, end: setTimeout(() => this.#stopAsking(), ASKS_FOR_MS) };
    return false;
  }

  #stopAsking() {
    if (this.#asking === null) return;
    const { button: asking, end } = this.#asking;
    clearTimeout(end);
    delete asking.dataset.asks;
    write(wordOf(asking), asking.dataset.word ?? '');
    this.#asking = null;
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

/** Where a button has its word. @param {HTMLButtonElement} asked */
function wordOf(asked) {
  return asked === released ? releaseWord : asked;
}

/** @param {string} text @param {'good' | 'bad' | 'quiet' | ''} tone */
function say(text, tone) {
  write(reply, text);
  reply.dataset.tone = tone;
}
