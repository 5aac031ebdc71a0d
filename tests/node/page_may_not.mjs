// The rights of a page without the token, and of a page of a read-only view.
//
//     node page_may_not.mjs URL READ-ONLY-URL

import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

const [address, readOnlyAddress] = process.argv.slice(2);

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, address.replace(/#.*/, ''));
  await stands(page, 'running');
  await reads(page, '#reply', /open the address that bench-dragon view printed/);
  const enabled = await page.$$eval(
    '#controls button, #setters button, #setters input',
    (all) => all.filter((one) => !one.disabled).length,
  );
  expect(enabled === 0, `${enabled} controls are enabled without a token`);
  await page.keyboard.press('h');
  await page.keyboard.press('Space');
  await page.evaluate((hash) => {
    location.hash = hash;
  }, new URL(address).hash);
  await page.waitForSelector('#hold:enabled');
  expect(!page.url().includes('token'), `the token is still in the address: ${page.url()}`);
  expect(complaints.length === 0, complaints.join('\n'));

  const wrong = await openPage(browser, address.replace(/token=.*/, 'token=00000000000000000000000000000000'));
  await stands(wrong.page, 'running');
  expect(await wrong.page.isDisabled('#hold'), 'a wrong token enables the controls');

  const blocked = await openPage(browser, address, { init: blockStorage });
  await stands(blocked.page, 'running');
  expect(await blocked.page.isEnabled('#hold'), 'with site data blocked, the token in the address is lost');
  await blocked.page.click('#theme');
  expect(blocked.complaints.length === 0, blocked.complaints.join('\n'));

  const readOnly = await openPage(browser, readOnlyAddress);
  await stands(readOnly.page, 'running');
  expect((await readOnly.page.$$('#controls, #setters')).length === 0, 'a page of a read-only view has controls');
  await readOnly.page.keyboard.press('h');
  await readOnly.page.keyboard.press('?');
  expect(await readOnly.page.isHidden('#shortcuts .control >> nth=0'), 'the page lists keys without an action');
  expect(readOnly.complaints.length === 0, readOnly.complaints.join('\n'));
  say({ type: 'passed' });
});

/** Makes storage throw, as in a browser with blocked site data. */
function blockStorage() {
  for (const name of ['localStorage', 'sessionStorage']) {
    Object.defineProperty(window, name, {
      get() {
        throw new DOMException('blocked', 'SecurityError');
      },
    });
  }
}
