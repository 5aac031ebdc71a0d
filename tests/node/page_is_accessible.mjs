// axe-core finds nothing: on a desk, in the dark, on a phone; running, paused, held, with the keys shown.
//
//     node page_is_accessible.mjs URL

import { axeSource, expect, openPage, say, stands, withBrowser } from './browser.mjs';

const SCREENS = {
  wide: {},
  dark: { colorScheme: 'dark' },
  phone: { viewport: { width: 360, height: 740 }, deviceScaleFactor: 2, isMobile: true, hasTouch: true },
};

await withBrowser(async (browser) => {
  const rules = [];
  for (const [name, options] of Object.entries(SCREENS)) {
    const { page } = await openPage(browser, process.argv[2], options);
    await stands(page, 'running');
    rules.push(await examine(page, `${name}, running`));
    await page.locator('#hold').focus();
    await page.keyboard.press('h');
    await stands(page, 'held');
    await examine(page, `${name}, held`);
    await page.keyboard.press('?');
    await page.waitForSelector('#shortcuts[open]');
    await examine(page, `${name}, shortcuts`);
    await page.keyboard.press('Escape');
    expect(await fits(page), `${name}: the page is wider than the screen`);
    await page.keyboard.press('Shift+R');
    await page.waitForFunction(() => document.body.dataset.status !== 'held');
    if (await page.evaluate(() => document.body.dataset.status === 'paused')) await page.click('#pause');
    await stands(page, 'running');
    await page.context().close();
  }
  say({ type: 'passed', rules });
});

/** Fails with what axe-core finds, and returns how many of its rules applied. */
async function examine(page, where) {
  // Through the protocol, as a debugger: the page's own policy lets no other script in.
  await page.evaluate(axeSource);
  const { violations, passes } = await page.evaluate(() => axe.run());
  const found = violations.map(({ id, help, nodes }) => `${id}: ${help}\n${nodes.map((node) => node.html).join('\n')}`);
  expect(found.length === 0, `${where}: ${found.join('\n')}`);
  return passes.length;
}

function fits(page) {
  return page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);
}
