// @ts-check
// A picture of the square under the drawing. The browser keeps it; two known points give its place, its scale and its direction.

import { element } from './element.js';

/** @typedef {[number, number]} Place */
/** Where the picture's upper left corner lies in metres, and its axis to the right for one pixel. @typedef {{x: number, y: number, ux: number, uy: number}} Map */
/** @typedef {{blob: Blob, map: Map}} Kept */

/** Width of a new picture, as a share of the part of the plane that is seen. */
const NEW_SHARE = 0.8;
const OPACITY = 0.55;
const STORE = 'pictures';

const dialog = element('picture-dialog', HTMLDialogElement);
const fields = ['ax', 'ay', 'bx', 'by'].map((id) => element(id, HTMLInputElement));

export class Picture {
  /** @type {ImageBitmap | null} */ #image = null;
  /** @type {Map} */ #map = { x: 0, y: 0, ux: 1, uy: 0 };
  /** @type {Blob | null} */ #blob = null;
  #count = 0;
  #name = '';
  #changed;

  /** @param {() => void} changed */
  constructor(changed) {
    this.#changed = changed;
    element('picture-cancel', HTMLButtonElement).addEventListener('click', () => dialog.close());
  }

  get isThere() {
    return this.#image !== null;
  }

  /** Brings back the picture of a file. @param {string} name */
  async open(name) {
    this.#name = name;
    const kept = await withStore('readonly', (store) => store.get(name)).catch(() => undefined);
    if (kept !== undefined) await this.#show(kept.blob, () => kept.map);
  }

  /** Takes a new picture. @param {Blob} blob @param {import('./camera.js').Camera} camera */
  async take(blob, camera) {
    await this.#show(blob, ({ width, height }) => {
      const scale = (NEW_SHARE * Math.min(camera.width / width, camera.height / height)) / camera.scale;
      return { x: camera.x - (scale * width) / 2, y: camera.y + (scale * height) / 2, ux: scale, uy: 0 };
    });
    await this.#keep();
  }

  /** @param {Blob} blob @param {(image: ImageBitmap) => Map} map */
  async #show(blob, map) {
    const image = await createImageBitmap(blob);
    this.#image = image;
    this.#blob = blob;
    this.#move(map(image));
  }

  /** @param {Map} map */
  #move(map) {
    this.#map = map;
    this.#count += 1;
    this.#changed();
  }

  async #keep() {
    const value = { blob: this.#blob, map: this.#map };
    // Without storage the picture stays until the page is closed.
    await withStore('readwrite', (store) => store.put(value, this.#name)).catch(() => undefined);
  }

  async remove() {
    this.#image = null;
    this.#count += 1;
    this.#changed();
    await withStore('readwrite', (store) => store.delete(this.#name)).catch(() => undefined);
  }

  /** Asks where two points of the picture are, and places it. @param {Place[]} points where they are now */
  place([a, b]) {
    [...a, ...b].forEach((value, at) => (fields[at].value = value.toFixed(2)));
    const form = element('picture-form', HTMLFormElement);
    const allow = () => fields[0].setCustomValidity('');
    form.oninput = allow;
    allow();
    form.onsubmit = (event) => {
      const [ax, ay, bx, by] = fields.map((field) => field.valueAsNumber);
      const map = moved(this.#map, [a, b], [[ax, ay], [bx, by]]);
      if (map === null) {
        event.preventDefault();
        fields[0].setCustomValidity('The two points must be apart, in the picture and on the ground.');
        fields[0].reportValidity();
        return;
      }
      this.#move(map);
      void this.#keep();
    };
    dialog.showModal();
  }

  /** What lies under the route. @returns {import('./route_layer.js').Underlay | null} */
  get underlay() {
    const image = this.#image;
    if (image === null) return null;
    const { x, y, ux, uy } = this.#map;
    return {
      key: `picture ${this.#count}`,
      draw(context) {
        context.save();
        context.globalAlpha = OPACITY;
        // The picture's second axis points down.
        context.transform(ux, uy, uy, -ux, x, y);
        context.drawImage(image, 0, 0);
        context.restore();
      },
    };
  }
}

/** The map that brings two points elsewhere; `null` if they are one. @param {Map} map @param {[Place, Place]} from @param {[Place, Place]} to @returns {Map | null} */
function moved({ x, y, ux, uy }, [a, b], [c, d]) {
  // As complex numbers: z → f · (z − a) + c, with f = (d − c) / (b − a).
  const [px, py, qx, qy] = [b[0] - a[0], b[1] - a[1], d[0] - c[0], d[1] - c[1]];
  const square = px * px + py * py;
  if (!(square > 0 && qx * qx + qy * qy > 0)) return null;
  const [fx, fy] = [(qx * px + qy * py) / square, (qy * px - qx * py) / square];
  const turn = (/** @type {number} */ zx, /** @type {number} */ zy) => [fx * zx - fy * zy, fx * zy + fy * zx];
  const [ox, oy] = turn(x - a[0], y - a[1]);
  const [vx, vy] = turn(ux, uy);
  return { x: ox + c[0], y: oy + c[1], ux: vx, uy: vy };
}

/** @template T @param {IDBTransactionMode} mode @param {(store: IDBObjectStore) => IDBRequest<T>} act @returns {Promise<T>} */
function withStore(mode, act) {
  return new Promise((resolve, reject) => {
    const opening = indexedDB.open('bench-dragon.plan', 1);
    opening.onupgradeneeded = () => opening.result.createObjectStore(STORE);
    opening.onerror = () => reject(opening.error);
    opening.onsuccess = () => {
      const request = act(opening.result.transaction(STORE, mode).objectStore(STORE));
      request.onsuccess = () => resolve(request.result);
      request.onerror = () => reject(request.error);
    };
  });
}
