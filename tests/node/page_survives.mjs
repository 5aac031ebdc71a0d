// A view that is killed and started again with another token: the measured curve is still there, on the open page and on a new
// one, and the open page says how it can steer again.
//
//     node page_survives.mjs URL URL-OF-THE-RESTARTED-VIEW

import { asks, confirm, expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

const [address, restarted] = process.argv.slice(2);
const LEAST_MEASURED = 5;

await withBrowser(async (browser) => {
  const { page } = await openPage(browser, address);
  await stands(page, 'running');
  await page.waitForFunction((least) => Number(document.querySelector('#timeline-area').dataset.measured) >= least, LEAST_MEASURED);
  await page.click('#pause');
  await stands(page, 'paused');
  await reads(page, '#commands li', /page@localhost/);
  const before = await measured(page);
  say({ type: 'restart the view', measured: before });
  await stands(page, 'view-lost');
  say({ type: 'lost' });
  await stands(page, 'paused');

  const fresh = await openPage(browser, restarted);
  await stands(fresh.page, 'paused');
  for (const [name, one] of [
    ['the open page', page],
    ['a new page', fresh.page],
  ]) {
    await one.waitForFunction((least) => Number(document.querySelector('#timeline-area').dataset.measured) >= least, before);
    const least = await reads(one, '#least', /^least \d+\.\d mm at/);
    say({ type: name, measured: await measured(one), least });
  }

  await reads(page, '#token-text', /can no longer steer.*Paste its new address/);
  expect(await page.isVisible('#token-field'), 'the page has no field for the new address');
  expect(await page.isDisabled('#pause'), 'a page with an old token offers commands');
  await page.fill('#token-field', restarted);
  await page.press('#token-field', 'Enter');
  await page.waitForSelector('#pause:enabled');
  expect(await page.isHidden('#token-notice'), 'the page asks for a token that it has');
  await page.click('#hold');
  await stands(page, 'held');
  await oneKeyDoesNotRelease(page);
  await confirm(page, '#release', '#release-word', /^Press again$/, /^released from tick \d+$/);
  say({ type: 'passed' });
});

/** The first press of the key asks, as the first press of the button does. */
async function oneKeyDoesNotRelease(page) {
  await page.click('h1');
  const reply = await page.textContent('#reply');
  await page.keyboard.press('Shift+R');
  await reads(page, '#release-word', /^Press again$/);
  expect((await page.textContent('#reply')) === reply, 'one press of the key sends a release');
  await reads(page, '#release-word', /^Release$/);
  await asks(page, '#release', '#release-word', /^Press again$/);
  await reads(page, '#release-word', /^Release$/);
  expect((await page.evaluate(() => document.body.dataset.status)) === 'held', 'one press releases');
}

function measured(page) {
  return page.evaluate(() => Number(document.querySelector('#timeline-area').dataset.measured));
}
