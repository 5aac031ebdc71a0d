// @ts-check
// The details of one bench: the bench under the pointer, else the one chosen by a tap or by its number.

import { board } from './boards.js';
import { element, write } from './element.js';
import * as format from './format.js';
import { dragonOf } from './frame.js';

/** @typedef {import('./show.js').Show} Show */

const form = element('details', HTMLFormElement);
const field = element('bench', HTMLInputElement);
const clear = element('bench-clear', HTMLButtonElement);
const values = element('bench-values', HTMLElement);
const role = element('bench-role', HTMLElement);

export class Details {
  /** @type {number | null} */ #chosen = null;
  /** @type {number | null} */ #pointed = null;

  /** @param {() => void} changed */
  constructor(changed) {
    form.addEventListener('submit', (event) => event.preventDefault());
    field.addEventListener('input', () => {
      const bench = field.valueAsNumber;
      this.#chosen = Number.isInteger(bench) && bench >= 0 ? bench : null;
      this.#pointed = null;
      changed();
    });
    clear.addEventListener('click', () => {
      this.choose(null);
      field.focus();
      changed();
    });
  }

  focus() {
    field.focus();
    field.select();
  }

  /** @param {number | null} bench */
  choose(bench) {
    this.#chosen = bench;
    field.value = bench === null ? '' : String(bench);
  }

  /** Sets the bench under the pointer. Returns whether it has changed. @param {number | null} bench */
  point(bench) {
    const isOther = bench !== this.#pointed;
    this.#pointed = bench;
    return isOther;
  }

  /** The bench whose details are shown. */
  bench() {
    return this.#pointed ?? this.#chosen;
  }

  /** @param {Show} show */
  write(show) {
    const { frame } = show;
    const bench = this.bench();
    const isThere = frame !== null && bench !== null && bench < frame.benches;
    if (frame !== null) field.max = String(frame.benches - 1);
    if (document.activeElement !== field && bench !== null) field.value = String(bench);
    if (document.activeElement !== field && bench === null && field.value !== '') field.value = '';
    values.hidden = !isThere;
    clear.hidden = this.#chosen === null;
    form.classList.toggle('is-open', isThere);
    if (!isThere) {
      write(
        role,
        bench === null || frame === null ? 'point at a bench, or type its number' : `must be 0 to ${frame.benches - 1}`,
      );
      return;
    }
    const number = dragonOf(frame, bench);
    const { first_bench, benches } = frame.dragons[number];
    const index = bench - first_bench;
    const name = show.runOfFrame()?.dragons?.[number]?.name;
    const part = index === 0 ? 'the head' : index === benches - 1 ? 'the tail' : 'of the body';
    write(role, name === undefined ? part : `${name} ${index}, ${part}`);
    const { x, y, z, ux, uy } = board(frame, show.runOfFrame(), bench);
    const height = z === null ? '' : `, ${format.fixed(z, 3)}`;
    const speed = (/** @type {number} */ handle) => `${format.fixed(frame.handles[handle * 3 + 2], 3)} m/s`;
    write(element('bench-centre', HTMLElement), `${format.fixed(x, 3)}, ${format.fixed(y, 3)}${height} m`);
    write(element('bench-heading', HTMLElement), `${format.fixed((Math.atan2(uy, ux) * 180) / Math.PI, 1)}°`);
    write(element('bench-front', HTMLElement), speed(bench + number));
    write(element('bench-rear', HTMLElement), speed(bench + number + 1));
  }
}
