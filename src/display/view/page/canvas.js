// @ts-check
// A canvas with the screen's resolution, at most twice the page's: a finer one looks the same and costs more.

const FINEST = 2;
const FAMILY = getComputedStyle(document.body).fontFamily;

/** The page's font for a canvas. @param {number} weight @param {number} size_px */
export const font = (weight, size_px) => `${weight} ${size_px}px ${FAMILY}`;

/**
 * Keeps a canvas at its displayed size. Returns functions that begin and clear a picture, in the page's pixels.
 * @param {HTMLCanvasElement} canvas
 * @param {(width: number, height: number) => void} resized
 */
export function fineCanvas(canvas, resized) {
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d', { alpha: false }));
  let ratio = 1;
  const measure = () => {
    ratio = Math.min(devicePixelRatio, FINEST);
    const { clientWidth, clientHeight } = canvas;
    canvas.width = Math.max(Math.round(clientWidth * ratio), 1);
    canvas.height = Math.max(Math.round(clientHeight * ratio), 1);
    resized(clientWidth, clientHeight);
  };
  new ResizeObserver(measure).observe(canvas);
  measure();
  return {
    context,
    /** @returns {number} canvas pixels per pixel of the page */
    ratio: () => ratio,
    begin() {
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
    },
    /** @param {string} ground */
    clear(ground) {
      context.fillStyle = ground;
      context.fillRect(0, 0, canvas.width, canvas.height);
    },
  };
}
