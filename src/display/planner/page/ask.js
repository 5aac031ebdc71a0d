// @ts-check
// The questions of `solve` with their options. One is under way at a time; its answer is put into the plan by one press.

import { element, write } from './element.js';
import { fixed } from './format.js';

/** @typedef {import('./plan_message.js').Asked} Asked */
/** @typedef {import('./plan_message.js').Put} Put */
/** @typedef {{flag: string, label: string, unit?: string, value?: number, isCheck?: boolean}} Option */
/** @typedef {{ask: string, name: string, options: Option[]}} Question */

const CLEARANCE = { flag: 'clearance', label: 'clearance', unit: 'm' };
const CIRCLE = { flag: 'turn-diameter', label: 'circle', unit: 'm' };
const PITCH = { flag: 'pitch', label: 'pitch', unit: 'm' };
const MAX_RATIO = { flag: 'max-ratio', label: 'fastest ÷ head' };
const LIMIT = { flag: 'limit', label: 'fastest handle', unit: 'm/s', value: 2 };
const WORK = { flag: 'work', label: 'work', unit: 'million' };

/** An empty option has the default of `solve`. @type {Question[]} */
const QUESTIONS = [
  { ask: 'pitch', name: 'Smallest pitch', options: [CIRCLE, CLEARANCE, WORK] },
  { ask: 'shortest', name: 'Shortest turn', options: [PITCH, CIRCLE, CLEARANCE, MAX_RATIO, WORK] },
  { ask: 'profile', name: 'Quickest profile', options: [LIMIT, { flag: 'accel', label: 'acceleration', unit: 'm/s²', value: 0.5 }, { flag: 'speed', label: 'fastest head', unit: 'm/s' }, { flag: 'within', label: 'longer by', unit: '%' }, WORK] },
  { ask: 'schedule', name: 'Earliest starts', options: [{ ...CLEARANCE, value: 0.5 }, { flag: 'order', label: 'also choose the order', isCheck: true }, WORK] },
  { ask: 'speed-limit', name: 'Speed limit', options: [LIMIT, WORK] },
  { ask: 'turn', name: 'Turn', options: [PITCH, CIRCLE, { flag: 'radius-ratio', label: 'ratio of radii' }, { flag: 'turn-line', label: 'line', unit: 'm' }, CLEARANCE, MAX_RATIO] },
  { ask: 'sensitivity', name: 'Sensitivity', options: [{ flag: 'range', label: 'change', unit: '%', value: 5 }, { flag: 'steps', label: 'steps', value: 2 }, CIRCLE, WORK] },
  { ask: 'sweep', name: 'Swept floor', options: [{ flag: 'tolerance', label: 'tolerance', unit: 'm', value: 0.01 }, WORK] },
];
/** The labels of all options, by their flags of `solve`. */
const LABELS = new Map(QUESTIONS.flatMap((question) => question.options).map(({ flag, label }) => [flag, label]));
/** Answers with tables, whose lines must not wrap. */
const TABLES = ['sensitivity', 'schedule'];

const form = element('ask-form', HTMLFormElement);
const chips = element('ask-questions', HTMLDivElement);
const options = element('ask-options', HTMLDivElement);
const state = element('ask-state', HTMLParagraphElement);
const words = element('ask-words', HTMLPreElement);
const put = element('ask-put', HTMLButtonElement);
const cancel = element('ask-cancel', HTMLButtonElement);

/**
 * @typedef {object} AskHands
 * @property {(ask: string, options: Record<string, number | boolean>) => number} ask returns the number of the question; 0 if it cannot be asked
 * @property {() => void} cancel
 * @property {(puts: Put[]) => void} put
 * @property {() => void} undo
 * @property {() => string} text the text of the plan
 */

export class Ask {
  #hands;
  /** @type {Question} */ #question = QUESTIONS[0];
  #number = 0;
  #asked = '';
  /** @type {Put[] | null} */ #puts = null;
  /** The text with the answer; `null` before it is put there. @type {string | null} */ #with = null;
  #isPutting = false;

  /** @param {AskHands} hands */
  constructor(hands) {
    this.#hands = hands;
    chips.append(...QUESTIONS.map((question) => this.#chip(question)));
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      this.#ask();
    });
    cancel.addEventListener('click', () => this.#hands.cancel());
    element('ask-back', HTMLButtonElement).addEventListener('click', () => this.#choose(null));
    put.addEventListener('click', () => this.#put());
  }

  /** @param {Question} question */
  #chip(question) {
    const button = document.createElement('button');
    button.type = 'button';
    button.textContent = question.name;
    button.addEventListener('click', () => this.#choose(question));
    return button;
  }

  /** @param {Question | null} question */
  #choose(question) {
    if (this.#number !== 0) this.#hands.cancel();
    this.#clear('');
    chips.hidden = question !== null;
    form.hidden = question === null;
    if (question === null) return /** @type {HTMLElement} */ (chips.children[QUESTIONS.indexOf(this.#question)]).focus();
    this.#question = question;
    write(element('ask-title', HTMLHeadingElement), question.name);
    options.replaceChildren(...question.options.map(newOption));
    element('ask-go', HTMLButtonElement).focus();
  }

  #ask() {
    /** @type {Record<string, number | boolean>} */ const chosen = {};
    for (const input of options.querySelectorAll('input')) {
      if (input.type === 'checkbox') chosen[input.name] = input.checked;
      else if (input.value !== '') chosen[input.name] = input.valueAsNumber;
    }
    this.#asked = this.#hands.text();
    this.#clear('asking …');
    this.#number = this.#hands.ask(this.#question.ask, chosen);
    if (this.#number === 0) return this.#clear('The planner does not answer. Ask again.', 'bad');
    cancel.disabled = false;
  }

  /** @param {string} text @param {string} [tone] */
  #clear(text, tone = '') {
    this.#number = 0;
    this.#puts = null;
    this.#with = null;
    words.hidden = true;
    put.hidden = true;
    cancel.disabled = true;
    write(state, text);
    state.dataset.tone = tone;
  }

  /** @param {Asked} answer */
  take(answer) {
    if (answer.number !== this.#number) return;
    if (answer.state === 'running') {
      const share = answer.share === null ? '' : `, ${fixed(100 * (answer.share ?? 0), 0)} % done`;
      return write(state, `asking for ${fixed(answer.elapsed_s, 0)} s${share} …`);
    }
    if (answer.state === 'failed') return this.#clear(inWords(answer.words ?? ''), 'bad');
    if (answer.state === 'cancelled') return this.#clear('cancelled');
    this.#clear('');
    words.hidden = false;
    words.dataset.table = String(TABLES.includes(this.#question.ask));
    words.textContent = inWords(answer.words ?? '').trimEnd();
    this.#puts = answer.puts ?? null;
    this.show();
  }

  /** The planner is not there: a question under way is lost. */
  lost() {
    if (this.#number !== 0) this.#clear('The planner does not answer. Ask again.', 'bad');
  }

  #put() {
    if (this.#with !== null) return this.#hands.undo();
    this.#isPutting = true;
    this.#hands.put(this.#puts ?? []);
  }

  /** An edit is done, perhaps this answer. */
  edited() {
    if (this.#isPutting) this.#with = this.#hands.text();
    this.#isPutting = false;
  }

  show() {
    if (this.#number !== 0 || words.hidden) return;
    const text = this.#hands.text();
    if (this.#with !== null && text !== this.#with) this.#with = null;
    put.hidden = this.#puts === null;
    put.textContent = this.#with === null ? 'Put it into the plan' : 'Take it out again';
    write(state, text === this.#asked || text === this.#with ? '' : 'The plan has changed since.');
  }
}

/** Words of the command line, with the names that the options have here. @param {string} text */
const inWords = (text) => text.replace(/--([a-z]+(?:-[a-z]+)*)/g, (flag, name) => (LABELS.has(name) ? `“${LABELS.get(name)}”` : flag));

/** @param {Option} option */
function newOption({ flag, label, unit, value, isCheck }) {
  const item = document.createElement('label');
  const input = document.createElement('input');
  input.name = flag;
  if (isCheck) {
    input.type = 'checkbox';
    item.className = 'check';
    item.append(input, label);
    return item;
  }
  Object.assign(input, { type: 'number', step: 'any', inputMode: 'decimal', placeholder: 'default', value: value ?? '' });
  item.append(unit === undefined ? label : `${label}, ${unit}`, input);
  return item;
}
