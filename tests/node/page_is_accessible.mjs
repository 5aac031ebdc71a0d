// axe-core finds no violation: on a desktop, in the dark theme and on a phone; running, paused, held and with the list of keys;
// and on pages whose picture is not live. The test suspends the server and kills the view when it reads the lines of this
// scenario.
//
//     node page_is_accessible.mjs URL URL-WITHOUT-SERVER

import { examine } from './accessible.mjs';
import { expect, openPage, reach, say, stands, withBrowser } from './browser.mjs';

const [address, emptyAddress] = process.argv.slice(2);
const SCREENS = {
  wide: {},
  dark: { colorScheme: 'dark' },
  phone: { viewport: { width: 360, height: 740 }, deviceScaleFactor: 2, isMobile: true, hasTouch: true },
};

await withBrowser(async (browser) => {
  const rules = [];
  const pages = [];
  for (const [name, options] of Object.entries(SCREENS)) {
    const { page } = await openPage(browser, address, options);
    await stands(page, 'running');
    rules.push(await examine(page, `${name}, running`));
    await page.locator('#hold').focus();
    await reach(page, 'held', () => page.keyboard.press('h'));
    await examine(page, `${name}, held`);
    await page.keyboard.press('?');
    await page.waitForSelector('#shortcuts[open]');
    await examine(page, `${name}, shortcuts`);
    await page.keyboard.press('Escape');
    expect(await fits(page), `${name}: the page is wider than the screen`);
    await reach(page, 'running', async () => {
      // The second press of the key confirms the first one.
      for (let press = 0; press < 2; press += 1) await page.keyboard.press('Shift+R');
      if (await page.evaluate(() => document.body.dataset.status === 'paused')) await page.click('#pause');
    });
    pages.push([name, page]);

    const empty = await openPage(browser, emptyAddress, options);
    await stands(empty.page, 'waiting');
    await examine(empty.page, `${name}, waiting`);
    await empty.page.context().close();
    const idle = await openPage(browser, address.replace(/#.*/, ''), options);
    await stands(idle.page, 'running');
    await examine(idle.page, `${name}, without a token`);
    await idle.page.context().close();
  }
  say({ type: 'suspend the server' });
  await examineAll(pages, 'silent');
  say({ type: 'kill the view' });
  await examineAll(pages, 'view-lost');
  say({ type: 'passed', rules });
});

async function examineAll(pages, status) {
  for (const [name, page] of pages) {
    await stands(page, status);
    await examine(page, `${name}, ${status}`);
  }
}

function fits(page) {
  return page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);
}
