// A killed server, and a killed view. The test kills them when it reads the lines of this scenario.
//
//     node page_loses.mjs URL

import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, process.argv[2]);
  await stands(page, 'running');
  say({ type: 'kill the server' });
  await stands(page, 'lost');
  await reads(page, '#word', /^SERVER LOST$/);
  expect((await stripes(page)) === 'true', 'a picture that is not live has no stripes');
  const old = await reads(page, '#explanation', /is \d+\.\d s old\. Use the wired stop\./);
  await page.waitForFunction((text) => document.querySelector('#explanation').textContent !== text, old);
  expect(await isUncovered(page), 'something lies over the last picture');
  say({ type: 'start a server', shown_after_ms: await shownAfterMs(page) });
  await stands(page, 'running');
  expect((await stripes(page)) === 'false', 'a live picture has stripes');
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

/** Whether the strip has the stripes of a lost show. */
function stripes(page) {
  return page.getAttribute('body', 'data-stripes');
}

/** Whether the plan itself is on top at some places of the plan. */
function isUncovered(page) {
  return page.evaluate(() => {
    const { left, top, width, height } = document.querySelector('#plan').getBoundingClientRect();
    const shares = [0.1, 0.5, 0.9];
    const places = shares.flatMap((x) => shares.map((y) => [left + x * width, top + y * height]));
    return places.every(([x, y]) => document.elementFromPoint(x, y).closest('#plan-area') !== null);
  });
}

/** The displayed silence in seconds, once it exceeds `least_s`. Showing the tab does not reset it. */
async function silenceSeconds(page, least_s) {
  const longer = await page.waitForFunction((least) => {
    const [, shown] = /for (\d+\.\d) s/.exec(document.querySelector('#explanation').textContent) ?? [];
    return Number(shown) > least && Number(shown);
  }, least_s);
  return longer.jsonValue();
}

function shownAfterMs(page) {
  return page.evaluate(() => Number(document.body.dataset.shownAfterMs));
}
