// GO by the key and by the button, each at a cue that waits. After each one, the test compares the bus.
//
//     node page_goes.mjs URL

import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, process.argv[2]);
  await waits(page, 'the gate');
  const [word, next] = await Promise.all(['#word', '#next'].map((id) => page.textContent(id)));
  say({ word, next, cues: await page.locator('#cues li').count() });
  await page.click('h1');
  await page.keyboard.press('g');
  await reads(page, '#reply', /^GO from tick \d+$/);
  await stands(page, 'running');
  // Nothing waits now.
  await page.waitForSelector('#go:disabled');
  await waits(page, 'the eye');
  say({ next: await page.textContent('#next') });
  await page.click('#go');
  await stands(page, 'running');
  expect(complaints.length === 0, complaints.join('\n'));
});

/** Waits until the page shows that the show waits at a cue, and offers GO. */
async function waits(page, name) {
  await stands(page, 'cue');
  await reads(page, '#next', new RegExp(`^GO for ${name}`));
  await page.waitForSelector('#go:not([disabled])');
}
