// @ts-check
// The planner's page. A hand, a key or the text changes the plan; the planner answers; the drawing follows.

import { Ask } from './ask.js';
import { Camera } from './camera.js';
import { choosable, idOf, listenToChosen, sideAfter } from './chosen.js';
import { Curve } from './curve.js';
import { Desk } from './desk.js';
import { Draft } from './draft.js';
import { Drawing, isMiddle, isOfBorder, isSame } from './drawing.js';
import { element, write } from './element.js';
import { Files, endNote, note } from './files.js';
import { fixed } from './format.js';
import { Ghost } from './ghost.js';
import { offerFiles } from './hand_over.js';
import { numbersOf, showNumbers } from './numbers.js';
import { readPalette } from './palette.js';
import { Pen } from './pen.js';
import { Picture } from './picture.js';
import { listenToKeys } from './plan_keys.js';
import { Player } from './player.js';
import { listenToPointers } from './pointer.js';
import { problemsOf, showProblems } from './problems.js';
import { listenToSnap, snap_m, snapped } from './snap.js';
import { State } from './state.js';
import { ofBrowser } from './storage.js';
import { offerTabs } from './tabs.js';
import { offerThemes } from './theme.js';
import { listenToAddress, takeToken } from './token.js';
import { listenToTools, showTools } from './tools.js';

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
const desk = new Desk(takeToken(), { answer, open: askText, lost });
let palette = readPalette();
let isDue = false;
/** While a hand holds a handle: time between two drawings of what may lag behind, and when it was drawn. */
const BESIDE_MS = 150;
let beside_ms = 0;
/** @type {HandleId | null} */ let chosen = null;
/** The dragon whose route is drawn. */
let dragon = 0;
/** The text that an edit changes, until it is done. @type {string | null} */ let base = null;
/** What is said of a text without an answer, and after which time. */
const [READING, READING_MS] = ['Reading the text …', 500];
let reading = 0;
/** Whether a hand holds a handle. */
let isHeld = false;
/** The plan time that the user has chosen; `null`: the contact, or the end. @type {number | null} */ let at_s = null;

const drawing = new Drawing(element('plan', HTMLCanvasElement), camera, palette, redraw);
const curve = new Curve(element('timeline', HTMLCanvasElement), palette, redraw);
const files = new Files(draft, desk, redraw);
offerFiles(draft, desk);
const player = new Player(seek, () => (state.plan === null ? null : { now_s: state.pose.time_s, times_s: state.plan.times_s, tick_s: 1 / state.plan.run.rate_hz }));
const pen = new Pen(camera, redraw);
const picture = new Picture(redraw);
const ghost = new Ghost(() => query({ at_s: state.pose.time_s }));
const showChosen = listenToChosen({ choose, add: addPoint, set: (keys, value) => edit({ kind: 'set', keys, value }), remove });

const ask = new Ask({
  ask: (question, options) => desk.solve({ text: draft.text, ask: question, options }),
  cancel: () => desk.cancel(),
  put: (puts) => edit({ kind: 'put', puts }),
  undo: () => step(draft.undo()),
  text: () => draft.text,
});

/** Asks, with what is new of the saved version. @param {import('./desk.js').Question} question */
function query(question) {
  desk.ask({ ...question, ...ghost.news(draft.saved.text) });
  clearTimeout(reading);
  reading = setTimeout(() => desk.isIdle || showLine(READING), READING_MS);
}

/** @returns {{at_s?: number}} */
const atTime = () => (at_s === null ? {} : { at_s });

/** Asks for the plan, also of a program that was started again. */
function askText() {
  showLine(null);
  // A program that was started again may have another token.
  void desk.access().then(({ may_save }) => {
    files.maySave = may_save;
    files.forget();
  }).then(redraw, () => {});
  ghost.forget();
  query({ text: draft.text, ...atTime() });
}

function lost() {
  ask.lost();
  showLine('The planner does not answer. Is it still running?');
}

/** @param {Answer} message */
function answer(message) {
  if (message.type === 'asked') return ask.take(message);
  state.take(message);
  if (message.type === 'plan' || message.type === 'pose') ghost.take(message.saved);
  if (message.type === 'plan') {
    if (chosen !== null && !message.handles.some((handle) => isSame(handle, chosen))) chosen = null;
    dragon = Math.min(dragon, message.routes.length - 1);
  }
  if (desk.isIdle) {
    clearTimeout(reading);
    if (element('line', HTMLParagraphElement).textContent === READING) showLine(null);
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
  ask.edited();
}

/** A change begins: what was said of the one before is no longer news. */
function beginAnew() {
  files.forget();
  endNote();
  showLine(null);
}

/** Changes the plan by one edit, as a step of undo. @param {Edit} change */
function edit(change) {
  if (isHeld || state.mistake !== null) return;
  base = draft.text;
  beginAnew();
  query({ text: draft.text, edit: change, ...atTime() });
}

function remove() {
  const handle = chosenHandle();
  if (handle?.can_delete) edit({ kind: 'delete', handle: idOf(handle) });
}

/** Puts a new point after the chosen one of a border. */
function addPoint() {
  const side = state.plan === null ? null : sideAfter(state.plan, chosenHandle());
  if (side === null) return;
  chosen = newPoint(side);
  edit({ kind: 'move', handle: idOf(side), to_m: [side.x_m, side.y_m] });
}

/** The point that a dragged middle becomes: the corner after it, or the next point of the border. @param {HandleId} middle @returns {HandleId} */
function newPoint(middle) {
  if (!isOfBorder(middle)) return { ...middle, kind: 'corner', at: middle.at + 1 };
  const kind = /** @type {'outline' | 'keep_out' | 'crowd'} */ (middle.kind.replace('_middle', ''));
  return { ...middle, kind, point: middle.point + 1 };
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
  if (handle !== null && !isOfBorder(handle)) dragon = handle.dragon;
  redraw();
}

/** @param {number} number */
function chooseDragon(number) {
  dragon = number;
  if (chosen?.dragon !== number) chosen = null;
  redraw();
}

const choice = () => ({ dragon, chosen });

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
  query({ at_s });
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
  beginAnew();
  showText(draft.text);
  query({ text: draft.text, ...atTime() });
  redraw();
}

/** Takes hold of a handle. @param {{x: number, y: number}} place @param {PointerEvent} event */
function grab(place, { pointerType, shiftKey }) {
  if (state.plan === null || state.mistake !== null || base !== null || pen.isActive) return null;
  const handle = drawing.handleAt(state.plan, choice(), place, pointerType !== 'mouse');
  if (handle === null) return null;
  area.focus({ preventScroll: true });
  const id = shiftKey && handle.kind === 'start' ? { ...idOf(handle), kind: /** @type {const} */ ('whole') } : idOf(handle);
  chosen = isMiddle(id) ? newPoint(id) : idOf(handle);
  camera.mode = 'free';
  beginAnew();
  const from = draft.text;
  const [hx, hy] = camera.toScreen(handle.x_m, handle.y_m);
  const [offX, offY] = [hx - place.x, hy - place.y];
  redraw();
  return {
    move(/** @type {{x: number, y: number}} */ { x, y }, /** @type {PointerEvent} */ { altKey }) {
      isHeld = true;
      base = from;
      query({ text: from, edit: { kind: 'move', handle: id, to_m: snapped(camera.toPlane(x + offX, y + offY), altKey) }, ...atTime() });
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
  showProblems(problemsOf(state), go, ({ puts }) => edit({ kind: 'put', puts }));
  showNumbers(numbersOf(state));
  drawing.underlay = picture.underlay;
  drawing.draw(plan, pose, contact, choice(), (context) => {
    if (plan.text !== draft.saved.text) ghost.draw(context, camera, palette.quiet);
    pen.draw(context, palette);
  });
  if (!isHeld || performance.now() - beside_ms > BESIDE_MS) drawBeside(plan);
  const at = chosenHandle();
  Object.assign(area.dataset, { number: String(plan.number), studied: String(state.isStudied), idle: String(desk.isIdle && base === null) });
  area.dataset.chosen = at === null ? '' : `${at.kind} ${at.x_m} ${at.y_m}`;
}

/** Draws what may lag a little behind a hand: the text is the slowest of all. @param {import('./plan_message.js').PlanMessage} plan */
function drawBeside(plan) {
  const { pose, contact } = state;
  beside_ms = performance.now();
  if (base !== null) showText(plan.text);
  showTools(plan, dragon, picture.isThere);
  curve.draw({ ...state, plan, contact, isOld: state.isCurveOld, time_s: pose.time_s });
  showChosen(plan, chosenHandle());
  ask.show();
  write(element('time', HTMLOutputElement), `${fixed(pose.time_s, 2)} s`);
  write(element('plan-text', HTMLElement), `${plan.run.benches} benches at ${fixed(pose.time_s, 2)} s.`);
  player.describe(element('timeline-area', HTMLDivElement));
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
  tap(place, isTouch, { altKey }) {
    if (pen.isActive) return pen.add(snapped(camera.toPlane(place.x, place.y), altKey));
    choose(state.plan === null ? null : drawing.handleAt(state.plan, choice(), place, isTouch));
  },
  hover(place) {
    if (pen.isActive && place !== null) return pen.hover(snapped(camera.toPlane(place.x, place.y), false));
    const isOver = place !== null && state.plan !== null && drawing.handleAt(state.plan, choice(), place, false) !== null;
    area.dataset.over = isOver ? 'handle' : '';
  },
  grab,
});
player.listenTo(element('timeline-area', HTMLDivElement), (x) => (state.plan === null ? null : curve.timeAt(state.plan, x)));
listenToKeys(area, {
  ...{ nudge, chooseNext, remove, play: () => player.toggle(), tick: (count) => player.tick(count), save: () => void files.save().then(redraw) },
  pen: (event) => pen.isActive && pen.key(event, snap_m()),
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
  beginAnew();
  query({ text: draft.text, ...atTime() });
  redraw();
});
listenToTools({
  ...{ chooseDragon, pen, picture, area },
  edit(change) {
    // A new dragon is beside the others.
    if (change.kind === 'add_dragon') camera.mode = 'fit';
    edit(change);
  },
  dragon: () => dragon,
  after: () => (chosen !== null && chosen.dragon === dragon && !isOfBorder(chosen) && chosen.kind !== 'start' ? chosen.at : null),
  importDrawing: (file) => void importDrawing(file),
  takePicture: (blob) => picture.take(blob, camera).catch(() => showLine('This file is no picture that the browser can show.')),
});
listenToSnap(redraw);
offerTabs(['edit', 'ask']);
listenToAddress(() => location.reload());
offerThemes(() => {
  palette = readPalette();
  drawing.recolour(palette);
  curve.palette = palette;
  redraw();
});

/** Makes a dropped drawing the route of the chosen dragon. @param {File} file */
async function importDrawing(file) {
  if (!files.maySave) return showLine('To import, open the printed address with its token.');
  showLine(`Reading ${file.name} …`);
  const { route, note: word, error } = await desk.importDrawing(file);
  if (route === undefined) return showLine(`Not possible: ${error}`);
  const owner = (state.plan?.routes.length ?? 1) > 1 || state.plan?.run.dragons !== undefined ? ['dragons', dragon] : [];
  edit({ kind: 'put', puts: [{ keys: [...owner, 'route'], value: route }] });
  camera.mode = 'fit';
  note(word ?? null);
}

/** Offers the five sentences to somebody who is here for the first time. */
function offerTour() {
  const seen = ofBrowser('bench-dragon.plan-tour');
  if (seen.read() !== null) return;
  const see = () => seen.write('seen');
  note('New here? Five sentences explain how to plan.', {
    'Show them': () => {
      see();
      element('shortcuts', HTMLDialogElement).showModal();
    },
    'No, thanks': see,
  });
}

/** Opens the file, or the draft of it. */
async function begin() {
  const { may_view, may_save } = await desk.access();
  if (!may_view) return note('This planner needs the printed address, with its token.');
  files.maySave = may_save;
  const file = await files.open();
  if (file.error !== undefined) return note(file.error);
  files.reload = (newer) => {
    draft.reload(newer);
    step(true);
  };
  if (!(await draft.begin(file))) offerTour();
  else {
    note('Your changes that were not saved are back.', { 'Discard them': () => files.reload(file) });
  }
  showText(draft.text);
  void picture.open(file.name ?? '');
  desk.open();
}

begin().catch(() => note('The planner does not answer. Is it still running? Reload this page when it is.'));
