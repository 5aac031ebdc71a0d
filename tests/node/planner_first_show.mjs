// A beginner opens the planner, draws a street, sees a contact, removes it, and saves the show. The scenario prints the time.
//
//     node planner_first_show.mjs URL

import { expect, openPage, reads, say, withBrowser } from './browser.mjs';
import { screenOf, settled, text } from './planner_page.mjs';

const [address] = process.argv.slice(2);
/** What was done, in its order. */
const steps = [];

await withBrowser(async (browser) => {
  const begun = performance.now();
  const { page, complaints } = await openPage(browser, address, { viewport: { width: 1440, height: 900 } });
  await settled(page);
  await page.click('#notice-buttons button:has-text("Show them")');
  await reads(page, '#shortcuts', /each problem has a button that goes to it/);
  await page.click('#shortcuts button');
  steps.push('five sentences');

  await page.click('.drawing-tools button:text-is("Route")');
  await page.click('.menu:popover-open button:has-text("Draw anew")');
  // A street that leads around a block and back across itself.
  for (const point of [[-8, -3], [6, -3], [6, 5], [-3, 5], [-3, -8], [-3, -8]]) {
    const { x, y } = await screenOf(page, point);
    await page.mouse.click(x, y);
  }
  await reads(page, '#problems', /touch at/);
  steps.push('a street with a contact');
  await page.click('#problems button:has-text("Go to")');
  await settled(page);
  steps.push('went to it');
  await page.click('.fixes button:has-text("end at")');
  await reads(page, '#numbers', /First contactnone/);
  steps.push('removed it');
  await page.click('#save');
  await page.fill('#name', 'first-show.toml');
  await page.click('#name-form button[type=submit]');
  await reads(page, '#saved', /^saved$/);
  steps.push('saved');
  expect(complaints.length === 0, complaints.join('\n'));
  say({ type: 'done', steps, seconds: (performance.now() - begun) / 1000, text: await text(page) });
});
