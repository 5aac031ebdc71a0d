// A server that is killed, and a view that is. The test does it when it reads of it here.
//
//     node page_loses.mjs URL

import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, process.argv[2]);
  await stands(page, 'running');
  say({ type: 'kill the server' });
  await stands(page, 'lost');
  await reads(page, '#banner-word', /^SERVER LOST$/);
  expect(await page.isVisible('#banner'), 'a picture that is not live has a banner over it');
  const old = await reads(page, '#banner-text', /is \d+\.\d s old/);
  await page.waitForFunction((text) => document.querySelector('#banner-text').textContent !== text, old);
  say({ type: 'start a server', shown_after_ms: await shownAfterMs(page) });
  await stands(page, 'running');
  expect(await page.isHidden('#banner'), 'a live picture has none');
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

/** For how long nothing has come, once that is longer than some time. Showing the tab does not begin it anew. */
async function silenceSeconds(page, least_s) {
  const longer = await page.waitForFunction((least) => {
    const [, said] = /for (\d+\.\d) s/.exec(document.querySelector('#banner-text').textContent) ?? [];
    return Number(said) > least && Number(said);
  }, least_s);
  return longer.jsonValue();
}

function shownAfterMs(page) {
  return page.evaluate(() => Number(document.body.dataset.shownAfterMs));
}
