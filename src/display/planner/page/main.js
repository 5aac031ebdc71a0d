// @ts-check
// The planner's page. A hand, a key or the text changes the plan; the planner answers; the drawing follows.

import { Camera } from './camera.js';
import { choosable, idOf, listenToChosen } from './chosen.js';
import { Curve } from './curve.js';
import { Desk } from './desk.js';
import { Draft } from './draft.js';
import { Drawing, isSame } from './drawing.js';
import { element, write } from './element.js';
import { Files, note } from './files.js';
import { fixed } from './format.js';
import { offerFiles } from './hand_over.js';
import { numbersOf, showNumbers } from './numbers.js';
import { readPalette } from './palette.js';
import { listenToKeys } from './plan_keys.js';
import { Player } from './player.js';
import { listenToPointers } from './pointer.js';
import { problemsOf, showProblems } from './problems.js';
import { State } from './state.js';
import { offerThemes } from './theme.js';
import { listenToAddress, takeToken } from './token.js';

/** @typedef {import('./plan_message.js').Edit} Edit */
/** @typedef {import('./plan_message.js').Handle} Handle */
/** @typedef {import('./plan_message.js').HandleId} HandleId */
/** @typedef {import('./plan_message.js').Answer} Answer */

const area = element('plan-area', HTMLDivElement);
const textField = element('text', HTMLTextAreaElement);
const mistake = element('mistake', HTMLParagraphElement);
const camera = new Camera();
const state = new State();
const draft = new Draft();
const desk = new Desk(takeToken(), { answer, open: askText, lost: () => showLine('The planner does not answer. Is it still running?') });
let palette = readPalette();
let isDue = false;
/** @type {HandleId | null} */ let chosen = null;
/** The text that an edit changes, until it is done. @type {string | null} */ let base = null;
/** Whether a hand holds a handle. */
let isHeld = false;
/** The plan time that the user has chosen; `null`: the contact, or the end. @type {number | null} */ let at_s = null;

const drawing = new Drawing(element('plan', HTMLCanvasElement), camera, palette, redraw);
const curve = new Curve(element('timeline', HTMLCanvasElement), palette, redraw);
const files = new Files(draft, desk, redraw);
offerFiles(draft, desk);
const player = new Player(seek, () => (state.plan === null ? null : { now_s: state.pose.time_s, times_s: state.plan.times_s }));
const showChosen = listenToChosen({ choose, set: (keys, value) => edit({ kind: 'set', keys, value }), remove });

/** @returns {{at_s?: number}} */
const atTime = () => (at_s === null ? {} : { at_s });

function askText() {
  showLine(null);
  desk.ask({ text: draft.text, ...atTime() });
}

/** @param {Answer} message */
function answer(message) {
  state.take(message);
  if (message.type === 'plan') {
    if (base !== null) showText(message.text);
    if (chosen !== null && !message.handles.some((handle) => isSame(handle, chosen))) chosen = null;
  }
  if (base !== null && !isHeld && desk.isIdle) finishEdit(message);
  redraw();
}

/** Makes an edit that a hand has ended a step of undo. @param {Answer} message */
function finishEdit(message) {
  base = null;
  if (message.type === 'mistake') {
    // The text is that of the last good plan.
    state.mistake = null;
    showLine(`Not possible: ${message.reason}`);
  } else showLine(null);
  if (state.plan !== null) draft.commit(state.plan.text);
  showText(draft.text);
}

/** Changes the plan by one edit, as a step of undo. @param {Edit} change */
function edit(change) {
  if (isHeld || state.mistake !== null) return;
  base = draft.text;
  files.forget();
  desk.ask({ text: draft.text, edit: change, ...atTime() });
}

function remove() {
  const handle = chosenHandle();
  if (handle?.can_delete) edit({ kind: 'delete', handle: idOf(handle) });
}

/** @param {string | null} text */
function showLine(text) {
  const line = element('line', HTMLParagraphElement);
  line.hidden = text === null;
  write(line, text ?? '');
}

/** @param {string} text */
function showText(text) {
  if (textField.value !== text) textField.value = text;
}

/** The chosen handle, where it is now. @returns {Handle | null} */
const chosenHandle = () => state.plan?.handles.find((handle) => isSame(handle, chosen)) ?? null;

/** @param {HandleId | null} handle */
function choose(handle) {
  chosen = handle === null ? null : idOf(handle);
  redraw();
}

/** Chooses the next point, or the one before. @param {number} step */
function chooseNext(step) {
  if (state.plan === null) return;
  const all = choosable(state.plan);
  const now = all.findIndex((handle) => isSame(handle, chosen));
  choose(all[(now + step + (now < 0 && step < 0 ? 1 : 0) + all.length) % all.length] ?? null);
}

/** Moves the chosen point, or the drawing. @param {number} dx @param {number} dy @param {number} step_m */
function nudge(dx, dy, step_m) {
  const handle = chosenHandle();
  if (handle === null) {
    camera.pan(-dx * 60, dy * 60);
    return redraw();
  }
  if (!desk.isIdle) return;
  edit({ kind: 'move', handle: idOf(handle), to_m: [handle.x_m + dx * step_m, handle.y_m + dy * step_m] });
}

/** Shows the dragons at a plan time. @param {number} time_s */
function seek(time_s) {
  at_s = time_s;
  desk.ask({ at_s });
}

/** @param {import('./problems.js').Problem} problem */
function go({ time_s, point_m }) {
  if (time_s === undefined) return;
  player.stop();
  seek(time_s);
  if (point_m !== undefined) {
    camera.mode = 'free';
    camera.centre(...point_m);
  }
  redraw();
}

/** @param {boolean} isDone whether there was an edit to undo or to redo */
function step(isDone) {
  if (!isDone || isHeld) return;
  files.forget();
  showText(draft.text);
  desk.ask({ text: draft.text, ...atTime() });
  redraw();
}

/** Takes hold of a handle. @param {{x: number, y: number}} place @param {PointerEvent} event */
function grab(place, { pointerType, shiftKey }) {
  if (state.plan === null || state.mistake !== null || base !== null) return null;
  const handle = drawing.handleAt(state.plan, chosen, place, pointerType !== 'mouse');
  if (handle === null) return null;
  area.focus({ preventScroll: true });
  const id = shiftKey && handle.kind === 'start' ? { ...idOf(handle), kind: /** @type {const} */ ('whole') } : idOf(handle);
  // A dragged middle becomes the corner after it.
  chosen = id.kind === 'middle' ? { ...id, kind: 'corner', at: id.at + 1 } : idOf(handle);
  camera.mode = 'free';
  files.forget();
  const from = draft.text;
  const [hx, hy] = camera.toScreen(handle.x_m, handle.y_m);
  const [offX, offY] = [hx - place.x, hy - place.y];
  redraw();
  return {
    move(/** @type {{x: number, y: number}} */ { x, y }) {
      isHeld = true;
      base = from;
      desk.ask({ text: from, edit: { kind: 'move', handle: id, to_m: camera.toPlane(x + offX, y + offY) }, ...atTime() });
    },
    drop() {
      if (!isHeld) return;
      isHeld = false;
      if (desk.isIdle && state.plan !== null) finishEdit(state.plan);
      redraw();
    },
  };
}

function redraw() {
  if (isDue) return;
  isDue = true;
  requestAnimationFrame(() => {
    isDue = false;
    draw();
  });
}

function draw() {
  const { plan, pose, contact } = state;
  mistake.hidden = state.mistake === null || base !== null;
  write(mistake, mistake.hidden ? '' : (state.mistake ?? ''));
  textField.setAttribute('aria-invalid', String(!mistake.hidden));
  files.show(state.mistake === null);
  player.show();
  if (plan === null) return;
  drawing.draw(plan, pose, contact, chosen);
  curve.draw({ ...state, plan, contact, isOld: state.isCurveOld, time_s: pose.time_s });
  showProblems(problemsOf(state), go);
  showNumbers(numbersOf(state));
  showChosen(plan, chosenHandle());
  write(element('time', HTMLOutputElement), `${fixed(pose.time_s, 2)} s`);
  write(element('plan-text', HTMLElement), `${plan.run.benches} benches at ${fixed(pose.time_s, 2)} s.`);
  player.describe(element('timeline-area', HTMLDivElement));
  const at = chosenHandle();
  Object.assign(area.dataset, { number: String(plan.number), studied: String(state.isStudied), idle: String(desk.isIdle && base === null) });
  area.dataset.chosen = at === null ? '' : `${at.kind} ${at.x_m} ${at.y_m}`;
}

listenToPointers(area, {
  pan(dx, dy) {
    camera.pan(dx, dy);
    redraw();
  },
  zoom(factor, x, y) {
    camera.zoom(factor, x, y);
    redraw();
  },
  tap: (place, isTouch) => choose(state.plan === null ? null : drawing.handleAt(state.plan, chosen, place, isTouch)),
  hover(place) {
    const isOver = place !== null && state.plan !== null && drawing.handleAt(state.plan, chosen, place, false) !== null;
    area.dataset.over = isOver ? 'handle' : '';
  },
  grab,
});
player.listenTo(element('timeline-area', HTMLDivElement), (x) => (state.plan === null ? null : curve.timeAt(state.plan, x)));
listenToKeys(area, {
  ...{ nudge, chooseNext, remove, play: () => player.toggle(), save: () => void files.save().then(redraw) },
  undo: () => step(draft.undo()),
  redo: () => step(draft.redo()),
  zoom(factor) {
    if (factor === 0) camera.mode = 'fit';
    else camera.zoom(factor);
    redraw();
  },
});
element('undo', HTMLButtonElement).addEventListener('click', () => step(draft.undo()));
element('redo', HTMLButtonElement).addEventListener('click', () => step(draft.redo()));
element('help', HTMLButtonElement).addEventListener('click', () => element('shortcuts', HTMLDialogElement).showModal());
textField.addEventListener('input', () => {
  draft.type(textField.value, performance.now());
  files.forget();
  desk.ask({ text: draft.text, ...atTime() });
  redraw();
});
listenToAddress(() => location.reload());
offerThemes(() => {
  palette = readPalette();
  drawing.recolour(palette);
  curve.palette = palette;
  redraw();
});

/** Opens the file, or the draft of it. */
async function begin() {
  const { may_view, may_save } = await desk.access();
  if (!may_view) return note('This planner needs the printed address, with its token.');
  files.maySave = may_save;
  const file = await desk.file();
  if (file.error !== undefined) return note(file.error);
  if (draft.begin(file)) note('Your changes that were not saved are back.', 'Discard them', () => step((draft.reload(file), true)));
  showText(draft.text);
  desk.open();
}

begin().catch(() => note('The planner does not answer. Is it still running? Reload this page when it is.'));
