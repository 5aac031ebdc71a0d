// The wall: state, wall clock, time left, next event and clearance in letters of 48 px and more, and nothing else.
//
//     node page_wall.mjs URL PICTURES

import path from 'node:path';
import { examine } from './accessible.mjs';
import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

const [address, pictures] = process.argv.slice(2);
const LEAST_PX = 48;

await withBrowser(async (browser) => {
  for (const [name, viewport] of Object.entries({
    wide: { width: 1600, height: 1000 },
    low: { width: 1280, height: 720 },
    phone: { width: 390, height: 844 },
  })) {
    const wall = new URL(address);
    wall.search = '?wall';
    const { page, complaints } = await openPage(browser, wall.href, { viewport });
    await stands(page, 'running');
    await reads(page, '#wall-word', /^RUNNING$/);
    await reads(page, '#wall-time', /^\d\d:\d\d:\d\d$/);
    await reads(page, '#wall-left', /^\d+:\d\d left$/);
    await reads(page, '#wall-next', /^(near miss \d+\.\d mm|contact) in \d+:\d\d$/);
    await reads(page, '#wall-clearance', /^\d+\.\d mm$/);
    await page.screenshot({ path: path.join(pictures, `${name}-wall.png`) });
    const { texts, small, wide, high } = await page.evaluate(measure, LEAST_PX);
    expect(texts.length === 5, `the wall has more than five texts: ${JSON.stringify(texts)}`);
    expect(small.length === 0, `${name}: texts are too small: ${JSON.stringify(small)}`);
    expect(wide <= viewport.width && high <= viewport.height, `${name}: the wall needs ${wide} × ${high} px`);
    await examine(page, `${name}, wall`);
    const clock = await page.textContent('#wall-time');
    await page.waitForFunction((before) => document.querySelector('#wall-time').textContent !== before, clock);
    expect(complaints.length === 0, complaints.join('\n'));
    await page.context().close();
  }
  say({ type: 'passed' });
});

/** The visible texts of the page, and those that are too small. Runs in the page. */
function measure(leastPx) {
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const texts = [];
  const small = [];
  while (walker.nextNode()) {
    const element = walker.currentNode.parentElement;
    const text = walker.currentNode.textContent.trim();
    if (text === '' || !element.checkVisibility() || element.closest('.unseen, dialog, script')) continue;
    texts.push(text);
    if (parseFloat(getComputedStyle(element).fontSize) < leastPx) small.push(text);
  }
  const { scrollWidth, scrollHeight } = document.documentElement;
  return { texts, small, wide: scrollWidth, high: scrollHeight };
}
