// @ts-check
// Sentences of the view, in which commands stand between backticks.

/**
 * Writes sentences into an element. Words of a command are not broken at their hyphens.
 * @param {HTMLElement} target
 * @param {string} text
 */
export function writeSentences(target, text) {
  if (target.dataset.text === text) return;
  target.dataset.text = text;
  const parts = text.split('`').map((part, at) => (at % 2 === 0 ? document.createTextNode(part) : command(part)));
  target.replaceChildren(...parts);
}

/** @param {string} text */
function command(text) {
  const code = document.createElement('code');
  const words = text.split(' ').map((word) => {
    const made = document.createElement('span');
    made.textContent = word;
    return made;
  });
  words.forEach((word, at) => code.append(...(at === 0 ? [word] : [' ', word])));
  return code;
}
