// @ts-check
// Mouse, pen and touch on the plan: one pointer drags, two pinch, the wheel zooms, and a press without a drag is a tap.

const TAP_WITHIN_PX = 6;
const WHEEL_RATE = 0.0016;
const LINE_PX = 16;

/** @typedef {{x: number, y: number}} Place */
/**
 * @typedef {object} Hands
 * @property {(dx: number, dy: number) => void} pan
 * @property {(factor: number, x: number, y: number) => void} zoom
 * @property {(place: Place, isTouch: boolean, event: PointerEvent) => void} tap
 * @property {(place: Place | null) => void} hover
 * @property {(place: Place, event: PointerEvent) => Grabbed | null} [grab] takes hold of what is at a place, instead of panning
 */
/** @typedef {{move: (place: Place, event: PointerEvent) => void, drop: () => void}} Grabbed what a hand holds */

/**
 * @param {HTMLElement} area
 * @param {Hands} hands
 */
export function listenToPointers(area, hands) {
  /** @type {Map<number, Place>} */ const down = new Map();
  /** @type {Place | null} */ let pressed = null;
  /** @type {{id: number, held: Grabbed} | null} */ let grabbed = null;
  const place = (/** @type {MouseEvent} */ event) => {
    const { left, top } = area.getBoundingClientRect();
    return { x: event.clientX - left, y: event.clientY - top };
  };

  area.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    area.setPointerCapture(event.pointerId);
    const held = down.size === 0 && grabbed === null ? hands.grab?.(place(event), event) : null;
    if (held) {
      grabbed = { id: event.pointerId, held };
      return;
    }
    down.set(event.pointerId, place(event));
    pressed = down.size === 1 ? place(event) : null;
  });
  area.addEventListener('pointermove', (event) => {
    const now = place(event);
    if (grabbed?.id === event.pointerId) return grabbed.held.move(now, event);
    const before = down.get(event.pointerId);
    if (before === undefined) {
      if (event.pointerType === 'mouse') hands.hover(now);
      return;
    }
    if (pressed !== null && apart(pressed, now) < TAP_WITHIN_PX) return;
    pressed = null;
    area.classList.add('is-dragged');
    const other = [...down].find(([id]) => id !== event.pointerId)?.[1];
    if (other === undefined) hands.pan(now.x - before.x, now.y - before.y);
    else pinch(hands, other, before, now);
    down.set(event.pointerId, now);
  });
  const up = (/** @type {PointerEvent} */ event) => {
    if (grabbed?.id === event.pointerId) {
      grabbed.held.drop();
      grabbed = null;
    }
    if (!down.delete(event.pointerId)) return;
    area.classList.remove('is-dragged');
    if (pressed !== null && event.type === 'pointerup') hands.tap(pressed, event.pointerType !== 'mouse', event);
    pressed = null;
  };
  area.addEventListener('pointerup', up);
  area.addEventListener('pointercancel', up);
  area.addEventListener('pointerleave', () => hands.hover(null));
  area.addEventListener(
    'wheel',
    (event) => {
      event.preventDefault();
      const { x, y } = place(event);
      const delta = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_PX : 1);
      hands.zoom(Math.exp(-delta * WHEEL_RATE), x, y);
    },
    { passive: false },
  );
}

/** @param {Hands} hands @param {Place} still @param {Place} before @param {Place} now */
function pinch(hands, still, before, now) {
  const [was, is] = [middle(still, before), middle(still, now)];
  hands.pan(is.x - was.x, is.y - was.y);
  hands.zoom(Math.max(apart(still, now), 1) / Math.max(apart(still, before), 1), is.x, is.y);
}

/** @param {Place} a @param {Place} b */
const apart = (a, b) => Math.hypot(a.x - b.x, a.y - b.y);

/** @param {Place} a @param {Place} b */
const middle = (a, b) => ({ x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 });
