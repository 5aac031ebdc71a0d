// @ts-check
// The menu of files that are handed over. The planner makes each from the text as it is drawn.

import { element } from './element.js';
import { note } from './files.js';

/** @typedef {import('./draft.js').Draft} Draft */
/** @typedef {import('./desk.js').Desk} Desk */

const menu = element('hand-over-menu', HTMLElement);

/** @param {Draft} draft @param {Desk} desk */
export function offerFiles(draft, desk) {
  menu.addEventListener('beforetoggle', () => {
    if (menu.childElementCount === 0) void fill(draft, desk);
  });
}

/** @param {Draft} draft @param {Desk} desk */
async function fill(draft, desk) {
  const { files } = await ask(fetch('hand-over', { headers: desk.headers }), (response) => response.json());
  for (const { name, what } of files ?? []) {
    const button = document.createElement('button');
    button.type = 'button';
    button.append(Object.assign(document.createElement('strong'), { textContent: name }), ` ${what}`);
    button.addEventListener('click', () => {
      menu.hidePopover();
      void take(name, draft.text, desk);
    });
    menu.append(button);
  }
}

/** Asks for a file, and gives it to the browser. @param {string} file @param {string} text @param {Desk} desk */
async function take(file, text, desk) {
  note(`${file} is being made …`);
  const headers = { ...desk.headers, 'Content-Type': 'application/json' };
  const asked = fetch('hand-over', { method: 'POST', headers, body: JSON.stringify({ file, text }) });
  const made = await ask(asked, async (response) => ({ blob: await response.blob() }));
  if (made.blob === undefined) return;
  note(null);
  const link = document.createElement('a');
  link.href = URL.createObjectURL(made.blob);
  link.download = file;
  link.click();
  // The browser reads the file in its own time.
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/**
 * The content of a reply; nothing after a refusal, whose reason is shown.
 * @template {object} T
 * @param {Promise<Response>} asked
 * @param {(response: Response) => Promise<T>} read
 * @returns {Promise<Partial<T>>}
 */
async function ask(asked, read) {
  try {
    const response = await asked;
    if (response.ok) return await read(response);
    note((await response.json()).error);
  } catch {
    note('The planner does not answer. Is it still running?');
  }
  return {};
}
