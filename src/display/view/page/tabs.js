// @ts-check
// Tabs: one panel at a time. A press or the arrow keys change it.

import { element } from './element.js';

/** @param {readonly string[]} names names; each has a tab `NAME-tab` and a panel `NAME-panel` */
export function offerTabs(names) {
  const tabs = names.map((name) => element(`${name}-tab`, HTMLButtonElement));
  const choose = (/** @type {number} */ chosen) => {
    tabs.forEach((tab, at) => {
      tab.setAttribute('aria-selected', String(at === chosen));
      tab.tabIndex = at === chosen ? 0 : -1;
      element(`${names[at]}-panel`, HTMLElement).hidden = at !== chosen;
    });
  };
  tabs.forEach((tab, at) => {
    tab.addEventListener('click', () => choose(at));
    tab.addEventListener('keydown', (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (step === undefined) return;
      event.preventDefault();
      const next = (at + step + tabs.length) % tabs.length;
      choose(next);
      tabs[next].focus();
    });
  });
}
