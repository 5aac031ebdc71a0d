// @ts-check
// The tools above the drawing: the dragon whose route is drawn, menus, the ruler, and files that are dropped.

import { element } from './element.js';

/** @typedef {import('./plan_message.js').Edit} Edit */
/** @typedef {import('./plan_message.js').PlanMessage} PlanMessage */
/** @typedef {'outline' | 'keep_out' | 'crowd'} Border */
/** @typedef {'line' | 'arc' | 'spiral' | 'turnaround'} Segment */

/** Radius of new corners, in metres. */
const RADIUS_M = 4;
const PICTURES = ['png', 'jpg', 'jpeg'];

const dragons = element('dragon', HTMLSelectElement);
const importFile = element('import-file', HTMLInputElement);
const pictureFile = element('picture-file', HTMLInputElement);

/**
 * @typedef {object} ToolHands
 * @property {(edit: Edit) => void} edit
 * @property {() => number} dragon the one whose route is drawn
 * @property {() => number | null} after the chosen segment
 * @property {(dragon: number) => void} chooseDragon
 * @property {(file: File) => void} importDrawing
 * @property {(blob: Blob) => void} takePicture
 * @property {import('./pen.js').Pen} pen
 * @property {import('./picture.js').Picture} picture
 * @property {HTMLElement} area
 */

/** @param {ToolHands} hands */
export function listenToTools(hands) {
  for (const menu of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll('.menu'))) placeMenu(menu);
  dragons.addEventListener('change', () => hands.chooseDragon(Number(dragons.value)));
  element('ruler', HTMLButtonElement).addEventListener('click', () => measure(hands));
  onPress('data-act', (act) => actions[act]?.(hands));
  onPress('data-insert', (segment) => hands.edit({ kind: 'insert', dragon: hands.dragon(), after: hands.after(), segment: /** @type {Segment} */ (segment) }));
  onPress('data-border', (border) => drawBorder(hands, /** @type {Border} */ (border)));
  onPress('data-picture', (act) => {
    if (act === 'choose') pictureFile.click();
    else if (act === 'remove') void hands.picture.remove();
    else draw(hands, { words: 'Press two points whose places you know.', least: 2, most: 2, done: (points) => hands.picture.place(points) });
  });
  importFile.addEventListener('change', () => taken(importFile, hands.importDrawing));
  pictureFile.addEventListener('change', () => taken(pictureFile, hands.takePicture));
  listenToDrops(hands);
}

/** @type {Record<string, (hands: ToolHands) => void>} */
const actions = {
  through: (hands) => drawRoute(hands),
  import: () => importFile.click(),
  mirror: ({ edit, dragon }) => edit({ kind: 'mirror', dragon: dragon() }),
  reverse: ({ edit, dragon }) => edit({ kind: 'reverse', dragon: dragon() }),
  close: ({ edit, dragon }) => edit({ kind: 'close', dragon: dragon() }),
  'add-dragon': ({ edit }) => edit({ kind: 'add_dragon' }),
  'remove-dragon': ({ edit, dragon }) => edit({ kind: 'remove_dragon', dragon: dragon() }),
};

/** @param {ToolHands} hands @param {import('./pen.js').Job} job */
function draw({ pen, area }, job) {
  pen.start(job);
  area.focus({ preventScroll: true });
}

/** @param {ToolHands} hands */
function drawRoute(hands) {
  const dragon = hands.dragon();
  draw(hands, {
    words: 'Press the start, each corner, and the end twice.',
    least: 2,
    done: (points_m) => hands.edit({ kind: 'through', dragon, points_m, radius_m: RADIUS_M }),
  });
}

/** @param {ToolHands} hands @param {Border} border */
function drawBorder(hands, border) {
  const isLine = border === 'crowd';
  draw(hands, {
    words: isLine ? 'Press each point, the last one twice.' : 'Press each corner, the last one twice.',
    least: isLine ? 2 : 3,
    isClosed: !isLine,
    done: (points_m) => hands.edit({ kind: 'border', border, points_m }),
  });
}

/** @param {ToolHands} hands */
function measure(hands) {
  draw(hands, { words: 'Press points to measure.', least: 1, done: null });
}

/** @param {string} attribute @param {(value: string) => void} act */
function onPress(attribute, act) {
  for (const button of /** @type {NodeListOf<HTMLButtonElement>} */ (document.querySelectorAll(`[${attribute}]`))) {
    button.addEventListener('click', () => {
      /** @type {HTMLElement | null} */ (button.closest('.menu'))?.hidePopover();
      act(button.getAttribute(attribute) ?? '');
    });
  }
}

/** Opens a menu under its button. @param {HTMLElement} menu */
function placeMenu(menu) {
  const button = /** @type {HTMLElement} */ (document.querySelector(`[popovertarget="${menu.id}"]`));
  menu.addEventListener('beforetoggle', () => {
    const { left, bottom } = button.getBoundingClientRect();
    Object.assign(menu.style, { left: `${left}px`, top: `${bottom + 4}px` });
  });
  menu.addEventListener('keydown', (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    const all = /** @type {HTMLElement[]} */ ([...menu.querySelectorAll('button:enabled')]);
    const now = all.indexOf(/** @type {HTMLElement} */ (document.activeElement));
    all[(now + step + all.length) % all.length]?.focus();
  });
}

/** @param {HTMLInputElement} input @param {(file: File) => void} take */
function taken(input, take) {
  const file = input.files?.[0];
  input.value = '';
  if (file !== undefined) take(file);
}

/** @param {ToolHands} hands */
function listenToDrops({ importDrawing, takePicture }) {
  const plan = /** @type {HTMLElement} */ (document.querySelector('.plan'));
  document.addEventListener('dragover', (event) => {
    event.preventDefault();
    plan.dataset.drop = 'true';
  });
  document.addEventListener('dragleave', () => (plan.dataset.drop = 'false'));
  document.addEventListener('drop', (event) => {
    event.preventDefault();
    plan.dataset.drop = 'false';
    const file = event.dataTransfer?.files[0];
    if (file === undefined) return;
    const isPicture = PICTURES.includes(file.name.split('.').at(-1)?.toLowerCase() ?? '');
    if (isPicture) takePicture(file);
    else importDrawing(file);
  });
}

/** @param {PlanMessage} plan @param {number} dragon @param {boolean} hasPicture */
export function showTools(plan, dragon, hasPicture) {
  const names = plan.routes.map(({ name }) => name ?? '');
  dragons.hidden = names.length < 2;
  if (dragons.options.length !== names.length || names.some((name, at) => dragons.options[at].text !== name)) {
    dragons.replaceChildren(...names.map((name, at) => new Option(name, String(at))));
  }
  dragons.value = String(dragon);
  dragons.style.borderColor = plan.run.dragons?.[dragon]?.colour ?? '';
  for (const act of ['place', 'remove']) {
    /** @type {HTMLButtonElement} */ (document.querySelector(`[data-picture="${act}"]`)).disabled = !hasPicture;
  }
  /** @type {HTMLButtonElement} */ (document.querySelector('[data-act="remove-dragon"]')).disabled = names.length < 2;
}
