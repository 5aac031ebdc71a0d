// The layout of the page in each state of a show, on three screens: HOLD stays where it is and is reached first, and no text
// covers another one or is cut off. The test brings about the states when it reads the lines of this scenario.
//
//     node page_layout.mjs URL PICTURES

import path from 'node:path';
import { expect, openPage, say, stands, withBrowser } from './browser.mjs';

const [address, pictures] = process.argv.slice(2);
const SCREENS = {
  wide: { viewport: { width: 1600, height: 1000 } },
  low: { viewport: { width: 1280, height: 720 }, colorScheme: 'dark' },
  phone: { viewport: { width: 390, height: 844 }, isMobile: true, hasTouch: true },
};
/** A head brakes for as long as it has walked. While it walks again for a page that missed the stop, that page is examined so often. */
const WALKS = 5;
/** States in the order in which the test brings them about, and the status that the page has then. */
const STATES = [
  ['ready', 'ready'],
  ['running', 'running'],
  ['stopping', 'stopping'],
  ['held by an operator', 'held'],
  ['silent', 'silent'],
  ['lost', 'lost'],
  ['held after a restart', 'held'],
  ['paused', 'paused'],
  ['overlap', 'running', 'OVERLAP'],
  ['finished', 'finished'],
  ['without a guard', 'held'],
  ['ended', 'ended'],
  ['without a view', 'view-lost'],
];
/** Smallest text that an operator needs, in pixels. */
const LEAST_PX = 16;

await withBrowser(async (browser) => {
  const pages = [];
  for (const [name, options] of Object.entries(SCREENS)) {
    const { page } = await openPage(browser, address, options);
    pages.push({ name, page, hold: null });
  }
  for (const [state, status, tag] of STATES) {
    say({ type: state });
    for (const shown of pages) await (state === 'stopping' ? examineStop(shown) : examine(shown, state, status, tag));
  }
  say({ type: 'passed' });
});

/** Examines a page while the head brakes. A page that the machine kept from it lets the head walk and stop again. */
async function examineStop(shown) {
  for (;;) {
    await shown.page.waitForFunction(() => ['stopping', 'held'].includes(document.body.dataset.status));
    const isStopping = () => document.body.dataset.status === 'stopping';
    if (await shown.page.evaluate(isStopping)) {
      const measured = await look(shown, 'stopping');
      if (await shown.page.evaluate(isStopping)) return judge(shown, 'stopping', measured);
    }
    say({ type: 'walking' });
    for (let walk = 0; walk < WALKS; walk += 1) await examine(shown, 'running', 'running');
    say({ type: 'stopping' });
  }
}

async function examine(shown, state, status, tag) {
  const { page } = shown;
  await stands(page, status);
  if (tag !== undefined) await page.waitForFunction((wanted) => document.querySelector('#danger').textContent === wanted, tag);
  await judge(shown, state, await look(shown, state));
}

/** Takes a picture of a page, and measures it. */
async function look({ name, page }, state) {
  if (pictures !== undefined) await page.screenshot({ path: path.join(pictures, `${name}-${state.replaceAll(' ', '-')}.png`) });
  return page.evaluate(measure, LEAST_PX);
}

/** Reports what is wrong in a measured page. */
async function judge(shown, state, { hold, faults, first }) {
  const { name, page } = shown;
  const where = `${name}, ${state}`;
  expect(faults.length === 0, `${where}: ${faults.join('\n')}`);
  shown.hold ??= hold;
  expect(JSON.stringify(hold) === JSON.stringify(shown.hold), `${where}: HOLD moved from ${JSON.stringify(shown.hold)} to ${JSON.stringify(hold)}`);
  expect(first === 'hold', `${where}: the tab key reaches ${first} before HOLD`);
  if (state === 'running' && shown.isTabbed !== true) {
    shown.isTabbed = true;
    await page.keyboard.press('Tab');
    const focused = await page.evaluate(() => document.activeElement.id);
    expect(focused === 'hold', `${where}: the first press of the tab key reaches ${focused}`);
  }
}

/** Measures the page. Runs in the page. */
function measure(leastPx) {
  const faults = [];
  const textOf = (node) => node.textContent.trim().replaceAll(/\s+/g, ' ');
  const isVisible = (element) => element.checkVisibility({ visibilityProperty: true, opacityProperty: true });
  const isBar = (element) => getComputedStyle(element).position === 'fixed' || getComputedStyle(element).position === 'sticky';
  /** The bar over the page in which an element is; it covers what is scrolled behind it. */
  const barOf = (element) => {
    for (let at = element; at !== null; at = at.parentElement) if (isBar(at)) return at;
    return null;
  };
  const texts = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode;
    const element = node.parentElement;
    if (textOf(node) === '' || !isVisible(element) || element.closest('.unseen, dialog, script, .shapes')) continue;
    if (element.closest('.brand') && getComputedStyle(element.closest('.brand')).position === 'absolute') continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const font_px = parseFloat(getComputedStyle(element).fontSize);
    if (font_px < leastPx && !element.closest('kbd')) faults.push(`"${textOf(node)}" has ${font_px} px`);
    for (const rect of range.getClientRects()) {
      if (rect.width < 1) continue;
      const box = { text: textOf(node), left: rect.left, right: rect.right, top: rect.top, bottom: rect.bottom, bar: barOf(element), element };
      // The line is higher than its letters.
      const air = Math.max((rect.height - font_px) / 2, 0);
      box.top += air;
      box.bottom -= air;
      if (!isScrolledAway(box)) texts.push(box);
    }
  }

  /** Whether a list has scrolled a text out of sight. Reports a text that is cut off otherwise. */
  function isScrolledAway({ text, left, right, top, bottom, element }) {
    for (let at = element; at !== null; at = at.parentElement) {
      const { overflowX, overflowY } = getComputedStyle(at);
      const edge = at.getBoundingClientRect();
      const isOut = left < edge.left - 1 || right > edge.right + 1 || top < edge.top - 1 || bottom > edge.bottom + 1;
      if (overflowY === 'auto' && (top < edge.top || bottom > edge.bottom)) return true;
      const isBox = at.matches('.strip, .action, button, .controls, .tag');
      if (isOut && (isBox || overflowX === 'hidden')) faults.push(`"${text}" is cut off by ${at.id || at.className || at.tagName}`);
    }
    if (right > innerWidth + 1 || left < -1) faults.push(`"${text}" is beyond the screen`);
    return false;
  }

  for (const [at, one] of texts.entries()) {
    for (const other of texts.slice(at + 1)) {
      if (one.bar !== other.bar) continue;
      const wide = Math.min(one.right, other.right) - Math.max(one.left, other.left);
      const high = Math.min(one.bottom, other.bottom) - Math.max(one.top, other.top);
      if (wide > 1 && high > 1) faults.push(`"${one.text}" and "${other.text}" overlap`);
    }
  }
  for (const input of document.querySelectorAll('input')) {
    if (isVisible(input) && input.scrollWidth > input.clientWidth + 1) faults.push(`the text of ${input.id} is cut off`);
  }
  if (document.documentElement.scrollWidth > innerWidth) faults.push('the page is wider than the screen');

  const labels = JSON.parse(document.querySelector('#plan').dataset.labels ?? '[]');
  for (const [at, one] of labels.entries()) {
    for (const other of labels.slice(at + 1)) {
      const isApart =
        one.left + one.wide <= other.left || other.left + other.wide <= one.left || one.top + one.high <= other.top || other.top + other.high <= one.top;
      if (!isApart) faults.push(`labels of the plan overlap: ${JSON.stringify([one, other])}`);
    }
  }
  const levels = JSON.parse(document.querySelector('#timeline-area').dataset.levels ?? '[]').sort((a, b) => a - b);
  levels.forEach((y, at) => {
    if (at > 0 && y - levels[at - 1] < 13) faults.push(`two levels of the timeline are ${y - levels[at - 1]} px apart`);
  });

  const hold = document.querySelector('#hold');
  const { x, y, width, height } = hold.getBoundingClientRect();
  // A disabled HOLD is passed over, as it is in no order then.
  const all = [...document.querySelectorAll('button, input, a[href], [tabindex]')].filter((one) => one.tabIndex >= 0 && isVisible(one));
  const [first] = all.filter((one) => one === hold || !one.disabled);
  return { hold: { x, y, width, height }, faults: [...new Set(faults)], first: first.id };
}
