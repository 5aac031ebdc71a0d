// @ts-check
// A canvas that is as fine as the screen, up to twice as fine as the page: more nobody sees, and it costs.

const FINEST = 2;
const FAMILY = getComputedStyle(document.body).fontFamily;

/** The page's font, for a canvas. @param {number} weight @param {number} size_px */
export const font = (weight, size_px) => `${weight} ${size_px}px ${FAMILY}`;

/**
 * Keeps a canvas at the size that it is shown at, and returns how to begin a picture: in the page's pixels.
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
    /** @returns {number} the screen's own pixels for one of the page's */
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
