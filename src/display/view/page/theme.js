// @ts-check
import { element } from './element.js';
import { ofBrowser } from './storage.js';

const kept = ofBrowser('bench-dragon.theme');

/**
 * Offers a light and a dark theme. The system's setting applies until the user chooses one.
 * @param {() => void} changed
 */
export function offerThemes(changed) {
  const system = matchMedia('(prefers-color-scheme: dark)');
  const root = document.documentElement;
  const chosen = kept.read();
  if (chosen !== null) root.dataset.theme = chosen;
  system.addEventListener('change', changed);
  element('theme', HTMLButtonElement).addEventListener('click', () => {
    const isDark = (root.dataset.theme ?? (system.matches ? 'dark' : 'light')) === 'dark';
    root.dataset.theme = isDark ? 'light' : 'dark';
    kept.write(root.dataset.theme);
    changed();
  });
}
