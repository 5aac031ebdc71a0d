// Pictures per second that the page draws, by its own count.
//
//     node page_pace.mjs URL SCREEN BENCHES SECONDS

import { expect, openPage, say, stands, withBrowser } from './browser.mjs';

const [address, screen, benches, seconds] = process.argv.slice(2);
const SCREENS = {
  wide: { viewport: { width: 1440, height: 900 } },
  phone: { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, isMobile: true, hasTouch: true },
};

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, address, SCREENS[screen]);
  await stands(page, 'running');
  await page.waitForFunction((wanted) => document.querySelector('#plan').dataset.benches === wanted, benches);
  const before = await page.evaluate(() => document.querySelector('#plan').toDataURL());
  await page.waitForFunction((old) => document.querySelector('#plan').toDataURL() !== old, before);
  // The first second is not counted, since the browser compiles the page.
  await second();
  const drawn = [];
  for (let counted = 0; counted < Number(seconds); counted += 1) {
    await second();
    drawn.push(Number(await page.getAttribute('#plan', 'data-fps')));
  }
  expect(complaints.length === 0, complaints.join('\n'));
  say({ drawn_per_s: drawn });
});

function second() {
  return new Promise((resolve) => {
    setTimeout(resolve, 1000);
  });
}
