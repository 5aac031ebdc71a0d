// @ts-check
// The controls of the show. Hold always takes one press. A release lifts a safety stop, and a seek makes the dragon jump, so
// their buttons ask for confirmation. A control whose command would be refused is disabled, and shows the reason.

import { sendCommand } from './command.js';
import { element, write } from './element.js';
import * as format from './format.js';
import { askForToken } from './token_notice.js';

/** @typedef {import('./command.js').Command} Command */
/** @typedef {Exclude<Command['command'], 'pace'>} Control a command that has a control here */
/** @typedef {import('./connection.js').Access} Access */
/** @typedef {import('./show.js').Refusals} Refusals */

const ASKS_FOR_MS = 5000;

const button = (/** @type {string} */ id) => element(id, HTMLButtonElement);
const input = (/** @type {string} */ id) => element(id, HTMLInputElement);
/** A read-only view has no controls: these parts are removed. */
const parts = [element('controls', HTMLElement), element('setters', HTMLElement)];
const reply = element('reply', HTMLElement);
const released = button('release');
const releaseWord = element('release-word', HTMLElement);
/** These elements are kept here, since the page of a read-only view removes them. */
const [pauseButton, holdButton, speedButton, seekButton, goButton] = ['pause', 'hold', 'speed-set', 'seek-set', 'go'].map(button);
const pauseWord = element('pause-word', HTMLElement);
const pauseShape = element('pause-shape', SVGUseElement);
const WITHOUT_TOKEN = 'To steer the show, open the address that bench-dragon view printed.';
const NOTHING_TO_RELEASE = 'There is no hold to release.';
const seekRange = element('seek-range', HTMLElement);
const fields = { speed: input('speed-field'), seek: input('seek-field') };

export class Controls {
  /** @type {string | null} */ #token;
  /** Whether the operator has paused the show, also while the head still brakes. */
  #isPaused = false;
  /** Whether a hold, or the wait at the start, ends with a release. */
  #mayRelease = false;
  #releaseWord = 'Release';
  /** @type {Refusals | null} */ #refusals = null;
  /** The reason for which no command can reach the server. @type {string | null} */ #obstacle = 'There is no server.';
  #mayControl = false;
  #isReadOnly = false;
  #sent = 0;
  /** The number of the newest hold, and the reason if it failed. */
  #hold = { number: 0, failure: '' };
  /** The button that asks for confirmation, and its timer. @type {{button: HTMLButtonElement, end: number} | null} */
  #asking = null;

  /** @param {string | null} token */
  constructor(token) {
    this.#token = token;
    pauseButton.addEventListener('click', () => this.pauseOrResume());
    holdButton.addEventListener('click', () => this.hold());
    released.addEventListener('click', () => this.release());
    goButton.addEventListener('click', () => this.go());
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
    if (access.read_only) parts.forEach((part) => part.remove());
    this.#enable();
    askForToken(access, this.#token !== null);
    if (!this.#mayControl) say(WITHOUT_TOKEN, 'quiet');
    else if (reply.dataset.tone === 'quiet') say('', '');
  }

  /** Sets the range of show time for seeks, and the planned speed. @param {import('./show.js').Run} run */
  takeRun(run) {
    fields.seek.min = String(run.start_s);
    fields.seek.max = String(run.end_s);
    write(seekRange, `${format.fixed(run.start_s, 0)} to ${format.fixed(Math.floor(run.end_s), 0)}`);
    fields.speed.placeholder = String(run.planned_speed_mps);
  }

  /**
   * Takes over the expected outcome of each command.
   * @param {Refusals | null} refusals
   * @param {{isPaused: boolean, isHeld: boolean, isReady: boolean}} stops the operator's stops
   * @param {string | null} obstacle the reason for which no command can reach the server; `null` if one can
   */
  takeSituation(refusals, { isPaused, isHeld, isReady }, obstacle) {
    if (isPaused !== this.#isPaused) {
      write(pauseWord, isPaused ? 'Resume' : 'Pause');
      pauseShape.setAttribute('href', isPaused ? '#shape-running' : '#shape-paused');
    }
    const word = isReady ? 'Start' : 'Release';
    const mayRelease = isHeld || isReady;
    if (word !== this.#releaseWord || mayRelease !== this.#mayRelease) {
      if (this.#asking?.button === released) this.#stopAsking();
      write(releaseWord, word);
    }
    [this.#releaseWord, this.#mayRelease] = [word, mayRelease];
    [this.#isPaused, this.#refusals, this.#obstacle] = [isPaused, refusals, obstacle];
    this.#enable();
  }

  pauseOrResume() {
    void this.#send({ command: this.#isPaused ? 'resume' : 'pause' });
  }

  hold() {
    void this.#send({ command: 'hold' });
  }

  /** Walks on from a cue. Without a cue that waits, the key does nothing. */
  go() {
    if (this.#refusal('go') === null) void this.#send({ command: 'go' });
  }

  /** Offers GO for a show with cues. @param {boolean} hasCues */
  offerGo(hasCues) {
    if (goButton.hidden === hasCues) goButton.hidden = !hasCues;
  }

  /** Releases the show with the second press of the button or the key. The first one asks. */
  release() {
    if (this.#mayRelease && this.#isMeant(released, 'Press again', this.#releaseWord)) void this.#send({ command: 'release' });
  }

  /** Writes a show time into the field. Only the button or the enter key seeks it. @param {number} time_s */
  proposeSeek(time_s) {
    if (this.#isReadOnly) return;
    // Rounds to tenths within the range, whose ends may lie between tenths.
    const tenths = Math.min(Math.round(time_s * 10), Math.floor(Number(fields.seek.max) * 10));
    fields.seek.value = (Math.max(tenths, Math.ceil(Number(fields.seek.min) * 10)) / 10).toFixed(1);
  }

  /** Writes the plan time of a cue into the field, unrounded: a cue that waits, waits again. @param {number} at_s */
  proposeCue(at_s) {
    if (!this.#isReadOnly) fields.seek.value = String(at_s);
  }

  /**
   * The reason for which a command's button is disabled; `null` if it is enabled. The keys for pause, resume and hold send
   * their command nevertheless, since the page's data may be old.
   * @param {Control} command
   */
  #refusal(command) {
    if (!this.#mayControl) return WITHOUT_TOKEN;
    if (command === 'release' && !this.#mayRelease) return this.#obstacle ?? NOTHING_TO_RELEASE;
    return this.#obstacle ?? this.#refusals?.[command] ?? null;
  }

  #enable() {
    this.#switch(this.#isPaused ? 'resume' : 'pause', pauseButton);
    this.#switch('hold', holdButton);
    this.#switch('release', released);
    this.#switch('go', goButton);
    this.#switch('speed', fields.speed, speedButton);
    this.#switch('seek', fields.seek, seekButton);
  }

  /** @param {Control} command @param {(HTMLButtonElement | HTMLInputElement)[]} controls */
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
      // Without focus, the field no longer blocks keyboard shortcuts.
      fields[command].blur();
    });
    fields[command].addEventListener('input', () => {
      if (this.#asking?.button === seekButton) this.#stopAsking();
    });
  }

  /**
   * Whether a button is pressed for the second time. The first press asks for confirmation.
   * @param {HTMLButtonElement} pressed
   * @param {string} question
   * @param {string} word the button's usual text
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

  /** Sends a command. Shows its reply unless a newer command was sent; always shows a failed hold. @param {Command} command */
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

/** The element with a button's text. @param {HTMLButtonElement} asked */
function wordOf(asked) {
  return asked === released ? releaseWord : asked;
}

/** @param {string} text @param {'good' | 'bad' | 'quiet' | ''} tone */
function say(text, tone) {
  write(reply, text);
  reply.dataset.tone = tone;
}
