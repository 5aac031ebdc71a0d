// @ts-check
// The part of the plane on the screen. y points up in the plane and down on the screen.

/** A route may be 1000 km long. */
const LEAST_SCALE = 0.0005;
const LARGEST_SCALE = 4000;
/** Smallest scale, in pixels per metre, at which the head is followed. */
const FOLLOW_SCALE = 56;
/** Free margin at each side, as a share of the screen. */
const MARGIN = 0.02;
/** Height of the scale bar, in pixels. What is fitted lies above it. */
const FOOT_PX = 40;

/** @typedef {{x0: number, y0: number, x1: number, y1: number}} Box */
/** @typedef {'fit' | 'follow' | 'free'} Mode */

export class Camera {
  x = 0;
  y = 0;
  /** Pixels per metre. */
  scale = 40;
  width = 1;
  height = 1;
  /** @type {Mode} */ mode = 'fit';

  /** @param {number} width @param {number} height */
  resize(width, height) {
    this.width = width;
    this.height = height;
  }

  /** Shows all of a box. Small changes of the box do not move the view. @param {Box} box */
  fit(box) {
    const { x0, y0, x1, y1 } = rounded(box);
    const [wide, high] = [Math.max(x1 - x0, 0.1), Math.max(y1 - y0, 0.1)];
    const part = 1 - 2 * MARGIN;
    this.scale = clamp(Math.min((this.width * part) / wide, ((this.height - FOOT_PX) * part) / high));
    this.x = (x0 + x1) / 2;
    this.y = (y0 + y1) / 2 - FOOT_PX / 2 / this.scale;
  }

  /** @param {number} x @param {number} y */
  centre(x, y) {
    this.x = x;
    this.y = y;
  }

  follow() {
    this.mode = 'follow';
    this.scale = Math.max(this.scale, FOLLOW_SCALE);
  }

  /** Moves the picture by pixels. @param {number} dx @param {number} dy */
  pan(dx, dy) {
    this.mode = 'free';
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
  }

  /**
   * Zooms around the point under a pixel; while the head is followed, around the head.
   * @param {number} factor
   * @param {number} [px]
   * @param {number} [py]
   */
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [x, y] = this.toPlane(px, py);
    this.scale = clamp(this.scale * factor);
    if (this.mode === 'follow') return;
    this.mode = 'free';
    this.x = x - (px - this.width / 2) / this.scale;
    this.y = y + (py - this.height / 2) / this.scale;
  }

  /** @param {number} px @param {number} py @returns {[number, number]} */
  toPlane(px, py) {
    return [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale];
  }

  /** @param {number} x @param {number} y @returns {[number, number]} */
  toScreen(x, y) {
    return [this.width / 2 + (x - this.x) * this.scale, this.height / 2 - (y - this.y) * this.scale];
  }

  /** The part on the screen, with a margin of some metres. @param {number} around_m @returns {Box} */
  seen(around_m) {
    const [halfWide, halfHigh] = [this.width / 2 / this.scale + around_m, this.height / 2 / this.scale + around_m];
    return { x0: this.x - halfWide, y0: this.y - halfHigh, x1: this.x + halfWide, y1: this.y + halfHigh };
  }
}

/** The smallest box around a box, on a grid of between a 32nd and a 64th of its size. @param {Box} box @returns {Box} */
function rounded({ x0, y0, x1, y1 }) {
  const step = 2 ** Math.floor(Math.log2(Math.max(x1 - x0, y1 - y0, 0.1) / 32));
  const [down, up] = [Math.floor, Math.ceil].map((round) => (/** @type {number} */ at) => round(at / step) * step);
  return { x0: down(x0), y0: down(y0), x1: up(x1), y1: up(y1) };
}

/** @param {number} scale */
function clamp(scale) {
  return Math.min(Math.max(scale, LEAST_SCALE), LARGEST_SCALE);
}
