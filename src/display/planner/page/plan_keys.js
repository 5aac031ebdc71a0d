// @ts-check
// The keys of the planner. Those without Ctrl work in the drawing alone, so that the text can be typed.

/**
 * @typedef {object} PlanKeys
 * @property {(dx: number, dy: number, step_m: number) => void} nudge
 * @property {(step: number) => void} chooseNext
 * @property {() => void} remove
 * @property {(event: KeyboardEvent) => boolean} pen takes a key while the pen is in use
 * @property {() => void} play
 * @property {(ticks: number) => void} tick
 * @property {(factor: number) => void} zoom 0 shows all
 * @property {() => void} save
 * @property {() => void} undo
 * @property {() => void} redo
 */

/** Metres of an arrow key: alone, with Shift, with Alt. */
const [STEP_M, LARGE_STEP_M, SMALL_STEP_M] = [0.1, 1, 0.01];
const ZOOM = 1.25;

/** @param {HTMLElement} area @param {PlanKeys} hands */
export function listenToKeys(area, hands) {
  document.addEventListener('keydown', (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.altKey || document.querySelector('dialog[open]') !== null) return;
    const key = event.key.toLowerCase();
    const action = key === 's' ? hands.save : key === 'y' || (key === 'z' && event.shiftKey) ? hands.redo : key === 'z' ? hands.undo : undefined;
    if (action === undefined) return;
    event.preventDefault();
    action();
  });
  area.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey) return;
    if (hands.pen(event)) return event.preventDefault();
    const step_m = event.shiftKey ? LARGE_STEP_M : event.altKey ? SMALL_STEP_M : STEP_M;
    /** @type {Record<string, () => void>} */
    const actions = {
      ArrowLeft: () => hands.nudge(-1, 0, step_m),
      ArrowRight: () => hands.nudge(1, 0, step_m),
      ArrowUp: () => hands.nudge(0, 1, step_m),
      ArrowDown: () => hands.nudge(0, -1, step_m),
      n: () => hands.chooseNext(1),
      p: () => hands.chooseNext(-1),
      Delete: hands.remove,
      Backspace: hands.remove,
      ' ': hands.play,
      ',': () => hands.tick(-1),
      '.': () => hands.tick(1),
      '+': () => hands.zoom(ZOOM),
      '-': () => hands.zoom(1 / ZOOM),
      0: () => hands.zoom(0),
    };
    const action = actions[event.key];
    if (action === undefined) return;
    event.preventDefault();
    action();
  });
}
