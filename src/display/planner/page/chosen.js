// @ts-check
// The chosen point: its numbers to type, and a list of all points for the keyboard.

import { isMiddle, isOfBorder, isSame } from './drawing.js';
import { element, write } from './element.js';

/** @typedef {import('./plan_message.js').Handle} Handle */
/** @typedef {import('./plan_message.js').HandleId} HandleId */
/** @typedef {import('./plan_message.js').PlanMessage} PlanMessage */

const select = element('point', HTMLSelectElement);
const fields = element('fields', HTMLDivElement);
const remove = element('delete', HTMLButtonElement);
const add = element('add-point', HTMLButtonElement);
const hint = element('hint', HTMLParagraphElement);

/** What cannot be dragged. */
const HINTS = {
  drawing: 'A drawing is changed in its file. Here only its place can be dragged.',
  closed: 'The numbers of a closed path depend on each other. Change them in the text; here only its place can be dragged.',
};

/** @param {HandleId} handle */
export const idOf = ({ dragon, kind, at, point }) => ({ dragon, kind, at, point });

/** The points that may be chosen. @param {PlanMessage} plan */
export const choosable = (plan) => plan.handles.filter((handle) => !isMiddle(handle));

/** The middle of the side after a point of a border; without one, there is no side. @param {PlanMessage} plan @param {Handle | null} chosen */
export const sideAfter = (plan, chosen) => plan.handles.find(({ kind, at, point }) => kind === `${chosen?.kind}_middle` && at === chosen?.at && point === chosen.point) ?? null;

/** @param {{choose: (handle: Handle | null) => void, add: () => void, set: (keys: (string | number)[], value: number) => void, remove: () => void}} hands */
export function listenToChosen(hands) {
  let handles = /** @type {Handle[]} */ ([]);
  select.addEventListener('change', () => hands.choose(handles[Number(select.value)] ?? null));
  remove.addEventListener('click', () => hands.remove());
  add.addEventListener('click', () => hands.add());
  /** @param {PlanMessage} plan @param {Handle | null} chosen */
  const show = (plan, chosen) => {
    handles = choosable(plan);
    showList(plan, handles, chosen);
    showFields(chosen, hands.set);
    remove.disabled = !(chosen?.can_delete ?? false);
    add.hidden = chosen === null || !isOfBorder(chosen);
    add.disabled = sideAfter(plan, chosen) === null;
    const { kind, closed } = plan.routes[chosen?.dragon ?? 0] ?? { kind: 'path', closed: false };
    write(hint, kind === 'drawing' ? HINTS.drawing : closed ? HINTS.closed : '');
  };
  return show;
}

/** @param {PlanMessage} plan @param {Handle[]} handles @param {Handle | null} chosen */
function showList(plan, handles, chosen) {
  const isSeveral = plan.routes.length > 1;
  const names = handles.map((handle) => (isSeveral && !isOfBorder(handle) ? `${plan.routes[handle.dragon].name}: ${handle.name}` : handle.name));
  const wanted = ['choose a point', ...names];
  if (select.options.length !== wanted.length || wanted.some((name, at) => select.options[at].text !== name)) {
    select.replaceChildren(...wanted.map((name, at) => new Option(name, String(at - 1))));
  }
  select.value = String(chosen === null ? -1 : handles.findIndex((handle) => isSame(handle, chosen)));
}

/** @param {Handle | null} chosen @param {(keys: (string | number)[], value: number) => void} set */
function showFields(chosen, set) {
  const wanted = chosen?.fields ?? [];
  const isOther = fields.children.length !== wanted.length || wanted.some(({ keys }, at) => /** @type {HTMLElement} */ (fields.children[at]).dataset.keys !== JSON.stringify(keys));
  if (isOther) fields.replaceChildren(...wanted.map((field) => newField(field, set)));
  wanted.forEach(({ value }, at) => {
    const input = /** @type {HTMLInputElement} */ (fields.children[at].querySelector('input'));
    if (input !== document.activeElement) input.value = String(value);
  });
}

/** @param {import('./plan_message.js').Field} field @param {(keys: (string | number)[], value: number) => void} set */
function newField({ keys, label, unit }, set) {
  const item = document.createElement('label');
  item.dataset.keys = JSON.stringify(keys);
  const input = document.createElement('input');
  Object.assign(input, { type: 'number', step: 'any', inputMode: 'decimal' });
  input.addEventListener('change', () => {
    if (input.value !== '' && Number.isFinite(input.valueAsNumber)) set(keys, input.valueAsNumber);
  });
  item.append(unit === '' ? label : `${label}, ${unit}`, input);
  return item;
}
