// A contact stays until it is acknowledged, and alerts are filtered by kind.
//
//     node page_keeps_contacts.mjs URL

import { examine } from './accessible.mjs';
import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, process.argv[2]);
  await stands(page, 'held');
  say({ type: 'release' });
  await page.waitForSelector('#contacts:visible');
  const text = await reads(page, '#contacts-text', /^Contact: benches 0 and 8 at 412\.47 s/);
  await page.waitForSelector('.kind[data-kind="contact"]');
  await page.waitForSelector('.kind[data-kind="near"]');
  await examine(page, 'a contact');
  await page.click('.kind[data-kind="near"]');
  await page.waitForFunction(() => document.querySelectorAll('#alerts .alert[data-kind="near"]').length === 0);
  await reads(page, '#no-alerts', /^\d+ not listed\.$/);
  expect((await page.$$('#alerts .alert[data-kind="contact"]')).length > 0, 'the contact is not listed');
  await page.click('.kind[data-kind="near"]');
  await page.waitForSelector('#alerts .alert[data-kind="near"]');

  say({ type: 'seek', text });
  await page.waitForFunction(() => Number(document.querySelector('#show-time').textContent) < 300);
  expect(await page.isVisible('#contacts'), 'a seek removes the contact');
  await page.click('#acknowledge');
  await page.waitForSelector('#contacts', { state: 'hidden' });
  await page.reload();
  await page.waitForSelector('.kind[data-kind="contact"]');
  expect(await page.isHidden('#contacts'), 'an acknowledged contact returns after a reload');
  expect(complaints.length === 0, complaints.join('\n'));
  say({ type: 'passed' });
});
