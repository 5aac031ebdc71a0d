// @ts-check
// The stream from the view. The page opens it, reads it, and opens it again after a loss.

import { readFrame } from './frame.js';
import { tokenHeaders } from './token.js';

/** @typedef {import('./standing.js').Line} Line */
/** @typedef {import('./standing.js').Outcome} Outcome */
/** @typedef {{version: string, instance: string, read_only: boolean, may_view: boolean, may_control: boolean,
 *   viewers: number, max_viewers: number, is_full: boolean}} Access */
/**
 * @typedef {object} Listener
 * @property {(access: Access) => void} access
 * @property {(frame: import('./frame.js').Frame) => void} frame called right after the acknowledgement was sent
 * @property {(message: {type: string}) => void} message
 * @property {() => void} line called when the state of the connection has changed
 */

const PROTOCOL = 'bench-dragon.view.v1';
const TOKEN_PROTOCOL = 'bench-dragon.token.';
const GOING_AWAY = 1001;
/** Silence after which the connection counts as lost. The view always sends a status five times a second. */
const SILENT_AFTER_MS = 1500;
const LOOK_PERIOD_MS = 100;
const OPEN_WITHIN_MS = 3000;
const FIRST_DELAY_MS = 200;
const LONGEST_DELAY_MS = 2000;

export class Connection {
  /** @type {Line} */ line = { state: 'connecting', heard_ms: performance.now(), reason: null, outcome: null };
  /** @type {string | null} */ #token;
  #listener;
  /** @type {WebSocket | null} */ #socket = null;
  #delay_ms = FIRST_DELAY_MS;
  /** Number of the present attempt. Events of earlier attempts are ignored. */
  #attempt = 0;
  #hasWarned = false;

  /** @param {string | null} token @param {Listener} listener */
  constructor(token, listener) {
    this.#token = token;
    this.#listener = listener;
    setInterval(() => this.#lookWhetherSilent(), LOOK_PERIOD_MS);
  }

  /** Connects anew, with another token. @param {string} token */
  useToken(token) {
    this.#token = token;
    this.#delay_ms = FIRST_DELAY_MS;
    this.#close();
    void this.open();
  }

  async open() {
    const attempt = (this.#attempt += 1);
    const access = await this.#askForAccess();
    if (attempt !== this.#attempt) return;
    if (access === null) return this.#retry();
    if (typeof access === 'string') return this.#refuse(access);
    this.#listener.access(access);
    if (!access.may_view) return this.#refuse('This view needs the address with the token.');
    if (access.is_full)
      return this.#refuse(`${access.viewers} pages are open already, which is the limit.`);
    this.#openSocket(attempt);
  }

  /**
   * The rights that the view grants; the reason if it refuses; `null` if it is unreachable.
   * @returns {Promise<Access | string | null>}
   */
  async #askForAccess() {
    try {
      /** @type {HeadersInit} */
      const headers = this.#token === null ? {} : tokenHeaders(this.#token);
      const response = await fetch('access', {
        headers,
        cache: 'no-store',
        signal: AbortSignal.timeout(OPEN_WITHIN_MS),
      });
      return response.ok ? await response.json() : (await response.text()).trim();
    } catch {
      return null;
    }
  }

  /** @param {number} attempt */
  #openSocket(attempt) {
    const protocols = [PROTOCOL, ...(this.#token === null ? [] : [TOKEN_PROTOCOL + this.#token])];
    const socket = new WebSocket(streamAddress(document.baseURI), protocols);
    socket.binaryType = 'arraybuffer';
    this.#socket = socket;
    const limit = setTimeout(() => socket.close(), OPEN_WITHIN_MS);
    socket.addEventListener('open', () => {
      clearTimeout(limit);
      if (attempt !== this.#attempt) return;
      this.line.heard_ms = performance.now();
      // A new view has a new show.
      this.line.outcome = null;
      this.#set('open');
    });
    socket.addEventListener('message', ({ data }) => {
      if (attempt !== this.#attempt) return;
      this.line.heard_ms = performance.now();
      this.#delay_ms = FIRST_DELAY_MS;
      this.#take(socket, data);
    });
    socket.addEventListener('close', ({ code }) => {
      clearTimeout(limit);
      if (attempt !== this.#attempt) return;
      this.#socket = null;
      this.#retry(code === GOING_AWAY ? 'ended' : 'lost');
    });
  }

  /** @param {WebSocket} socket @param {unknown} data */
  #take(socket, data) {
    if (data instanceof ArrayBuffer) {
      const frame = readFrame(data);
      if (frame === null) return this.#warn('a frame');
      socket.send(JSON.stringify({ ack: frame.sequence }));
      this.#listener.frame(frame);
      return;
    }
    const message = parsed(String(data));
    if (message === null) this.#warn('a message');
    // It stays on the page until another view appears.
    else if (message.type === 'outcome') this.line.outcome = /** @type {Outcome & {type: string}} */ (message);
    else this.#listener.message(message);
  }

  /** Warns once: a view of another version would send the same kind of message again and again. @param {string} what */
  #warn(what) {
    if (!this.#hasWarned)
      console.warn(`bench-dragon: cannot read ${what} from the view; it may be of another version`);
    this.#hasWarned = true;
  }

  /** Checks for silence. A hidden tab receives little, so it is exempt. When shown again, an old picture must not look live. */
  #lookWhetherSilent() {
    const isSilent = performance.now() - this.line.heard_ms > SILENT_AFTER_MS;
    if (this.line.state !== 'open' || !isSilent || document.visibilityState === 'hidden') return;
    this.#close();
    this.#retry('lost');
  }

  #close() {
    this.#attempt += 1;
    this.#socket?.close();
    this.#socket = null;
  }

  /** @param {string} reason */
  #refuse(reason) {
    this.line.reason = reason;
    this.#retry('refused');
  }

  /** @param {Line['state']} [state] the new state of the connection; without it, only `open` changes, to `lost` */
  #retry(state) {
    if (state !== undefined) this.#set(state);
    else if (this.line.state === 'open') this.#set('lost');
    const attempt = this.#attempt;
    setTimeout(() => {
      if (attempt === this.#attempt) void this.open();
    }, this.#delay_ms);
    this.#delay_ms = Math.min(this.#delay_ms * 2, LONGEST_DELAY_MS);
  }

  /** @param {Line['state']} state */
  #set(state) {
    this.line.state = state;
    this.#listener.line();
  }
}

/**
 * The address of the stream beside a page, which may be under a path of a proxy.
 * @param {string} page
 */
function streamAddress(page) {
  const address = new URL('stream', page);
  address.protocol = address.protocol === 'https:' ? 'wss:' : 'ws:';
  return address;
}

/** @param {string} text @returns {{type: string} | null} */
function parsed(text) {
  try {
    const message = JSON.parse(text);
    return typeof message?.type === 'string' ? message : null;
  } catch {
    return null;
  }
}
