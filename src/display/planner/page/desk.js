// @ts-check
// The connection to the planner. One question is under way at a time; of those that come meanwhile, the newest is asked next.

import { tokenHeaders } from './token.js';

/** @typedef {import('./plan_message.js').Answer} Answer */
/** @typedef {import('./plan_message.js').Edit} Edit */
/** @typedef {{text?: string, edit?: Edit, at_s?: number, saved?: string}} Question */
/** @typedef {{version: string, may_view: boolean, may_save: boolean}} Access */

const PROTOCOL = 'bench-dragon.plan.v1';
const TOKEN_PROTOCOL = 'bench-dragon.token.';
const RETRY_MS = 700;

export class Desk {
  #token;
  #listener;
  /** @type {WebSocket | null} */ #socket = null;
  #number = 0;
  /** Number of the question under way; 0 without one. */
  #asked = 0;
  #asksText = false;
  /** @type {Question | null} */ #next = null;
  /** Number of the newest question of `solve`. */
  #solved = 0;
  /** Numbers of the questions with a text: studies of earlier ones are outdated. */
  planned = 0;

  /**
   * @param {string | null} token
   * @param {{answer: (answer: Answer) => void, open: () => void, lost: () => void}} listener
   */
  constructor(token, listener) {
    this.#token = token;
    this.#listener = listener;
  }

  get headers() {
    return this.#token === null ? {} : tokenHeaders(this.#token);
  }

  /** The rights of this page. @returns {Promise<Access>} */
  async access() {
    const response = await fetch('access', { headers: this.headers, cache: 'no-store' });
    return await response.json();
  }

  /**
   * A file on the disk; without a name, the one that the program was started with.
   * @param {string | null} name
   * @returns {Promise<{name: string | null, text: string, mark: string | null, error?: string}>}
   */
  async file(name) {
    const query = name === null ? '' : `?name=${encodeURIComponent(name)}`;
    const response = await fetch(`text${query}`, { headers: this.headers, cache: 'no-store' });
    return await response.json();
  }

  /**
   * Saves a text. Returns the mark of the file, or why it was refused.
   * @param {{name: string, text: string, known: string | null}} file
   * @returns {Promise<{mark?: string, error?: string, isConflict?: boolean}>}
   */
  async save(file) {
    const headers = { ...this.headers, 'Content-Type': 'application/json' };
    try {
      const response = await fetch('save', { method: 'POST', headers, body: JSON.stringify(file) });
      return { ...(await response.json()), isConflict: response.status === 409 };
    } catch {
      return { error: 'the planner does not answer: is it still running?' };
    }
  }

  /**
   * Puts a drawing into the configuration's folder. Returns the keys of `[route]` that follow it, or why it was refused.
   * @param {File} file
   * @returns {Promise<{route?: Record<string, unknown>, note?: string, error?: string}>}
   */
  async importDrawing(file) {
    const headers = { ...this.headers, 'Content-Type': 'application/octet-stream' };
    try {
      const response = await fetch(`import?name=${encodeURIComponent(file.name)}`, { method: 'POST', headers, body: file });
      return await response.json();
    } catch {
      return { error: 'the planner does not answer: is it still running?' };
    }
  }

  open() {
    const protocols = [PROTOCOL, ...(this.#token === null ? [] : [TOKEN_PROTOCOL + this.#token])];
    const address = new URL('stream', document.baseURI);
    address.protocol = address.protocol === 'https:' ? 'wss:' : 'ws:';
    const socket = new WebSocket(address, protocols);
    this.#socket = socket;
    this.#asked = 0;
    socket.addEventListener('open', () => this.#listener.open());
    socket.addEventListener('message', ({ data }) => this.#take(JSON.parse(data)));
    socket.addEventListener('close', () => {
      this.#socket = null;
      this.#listener.lost();
      setTimeout(() => this.open(), RETRY_MS);
    });
  }

  /** @param {Question} question */
  ask(question) {
    // Texts that were not asked yet are still asked, at the newest time.
    const { text, edit, saved } = this.#next ?? {};
    const kept = question.text === undefined && text !== undefined ? { text, edit } : {};
    this.#next = { saved, ...kept, ...question };
    this.#send();
  }

  /**
   * Asks a question of `solve`. It takes the place of the one before. Returns its number; 0 without a connection.
   * @param {{text: string, ask: string, options: Record<string, number | boolean>}} question
   */
  solve(question) {
    this.#solved += 1;
    return this.#sendNow({ number: this.#solved, ...question }) ? this.#solved : 0;
  }

  /** Cancels the question of `solve` under way. */
  cancel() {
    this.#sendNow({ cancel: true });
  }

  /** Returns whether there is a connection. @param {object} message */
  #sendNow(message) {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false;
    this.#socket.send(JSON.stringify(message));
    return true;
  }

  /** Whether every text has its answer. */
  get isIdle() {
    return !(this.#asked !== 0 && this.#asksText) && this.#next?.text === undefined;
  }

  #send() {
    if (this.#asked !== 0 || this.#next === null || this.#socket?.readyState !== WebSocket.OPEN) return;
    this.#number += 1;
    this.#asked = this.#number;
    this.#asksText = this.#next.text !== undefined;
    this.#socket.send(JSON.stringify({ number: this.#number, ...this.#next }));
    this.#next = null;
  }

  /** @param {Answer} answer */
  #take(answer) {
    if (answer.type === 'asked') return this.#listener.answer(answer);
    if (answer.type === 'plan') this.planned = answer.number;
    const isStudy = !['plan', 'pose', 'mistake'].includes(answer.type);
    if (isStudy && answer.number !== this.planned) return;
    if (!isStudy && answer.number === this.#asked) this.#asked = 0;
    this.#listener.answer(answer);
    this.#send();
  }
}
