// A guarded show: the page announces the guard's stop instead of a contact, and distinguishes the guard's situations.
//
//     node page_is_guarded.mjs URL

import { examine } from './accessible.mjs';
import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, process.argv[2]);
  await stands(page, 'running');
  await reads(page, '#outlook', /^Guard stops the head in \d+\.\d s$/);
  await reads(page, '#outlook-more', /^before benches \d+ and \d+ come too near, at show time \d+\.\d{3} s$/);
  await page.waitForSelector('.lamp[data-name="guard"][data-level="good"]');
  say({ type: 'seek' });
  await stands(page, 'held');
  await reads(page, '#explanation', /^The guard has stopped the dragon permanently: ahead, benches come nearer than the margin/);
  expect(await page.isDisabled('#release'), 'the page offers a release that would be refused');
  await examine(page, 'at the end of the proven travel');
  say({ type: 'kill the guard' });
  await reads(page, '#explanation', /^No guard runs/);
  await page.waitForSelector('.lamp[data-name="guard"][data-level="danger"]');
  await page.waitForSelector('#seek-set:disabled');
  expect(/no guard/.test(await page.getAttribute('#seek-set', 'title')), 'the page offers a seek without a guard');
  expect(complaints.length === 0, complaints.join('\n'));
  say({ type: 'passed' });
});
