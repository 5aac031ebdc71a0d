// A killed server, and a killed view. The test kills them when it reads the lines of this scenario.
//
//     node page_loses.mjs URL

import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, process.argv[2]);
  await stands(page, 'running');
  say({ type: 'kill the server' });
  await stands(page, 'lost');
  await reads(page, '#banner-word', /^SERVER LOST$/);
  expect(await page.isVisible('#banner'), 'a picture that is not live has no banner');
  const old = await reads(page, '#banner-text', /is \d+\.\d s old/);
  await page.waitForFunction((text) => document.querySelector('#banner-text').textContent !== text, old);
  say({ type: 'start a server', shown_after_ms: await shownAfterMs(page) });
  await stands(page, 'running');
  expect(await page.isHidden('#banner'), 'a live picture has a banner');
  expect(complaints.length === 0, complaints.join('\n'));

  say({ type: 'kill the view' });
  await stands(page, 'view-lost');
  const silence_s = await silenceSeconds(page, 0.1);
  await page.evaluate(() => document.dispatchEvent(new Event('visibilitychange')));
  await silenceSeconds(page, silence_s);
  say({ type: 'start a view', shown_after_ms: await shownAfterMs(page) });
  await stands(page, 'running');
  const refused = complaints.filter(
    (complaint) => !complaint.includes('ERR_CONNECTION_REFUSED') && !complaint.includes('WebSocket'),
  );
  expect(refused.length === 0, refused.join('\n'));

  say({ type: 'end the view' });
  await stands(page, 'view-ended');
  say({ type: 'seen' });
});

/** The displayed silence in seconds, once it exceeds `least_s`. Showing the tab does not reset it. */
async function silenceSeconds(page, least_s) {
  const longer = await page.waitForFunction((least) => {
    const [, shown] = /for (\d+\.\d) s/.exec(document.querySelector('#banner-text').textContent) ?? [];
    return Number(shown) > least && Number(shown);
  }, least_s);
  return longer.jsonValue();
}

function shownAfterMs(page) {
  return page.evaluate(() => Number(document.body.dataset.shownAfterMs));
}
