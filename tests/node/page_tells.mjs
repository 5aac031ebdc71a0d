// The page's texts during a show: the place of rest of a stopping head, the senders of commands, missing parts, and an orderly
// end. The test gives the commands when it reads the lines of this scenario.
//
//     node page_tells.mjs URL

import { examine } from './accessible.mjs';
import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, process.argv[2]);
  await stands(page, 'running');
  // At a time scale of 2, 360 s of show time are 180 s of wall time.
  await reads(page, '#outlook', /^Contact in \d+\.\d s$/);
  await reads(page, '#outlook-more', /^benches \d+ and \d+, at show time \d+\.\d{3} s$/);
  const [left_s, time_s, now_s] = await page.evaluate(() => {
    const number = (id, pattern) => Number(pattern.exec(document.querySelector(id).textContent)[1]);
    return [
      number('#outlook', /in ([\d.]+) s/),
      number('#outlook-more', /time ([\d.]+) s/),
      number('#show-time', /([\d.]+)/),
    ];
  });
  say({ type: 'forecast', left_s, time_s, now_s });

  await lamp(page, 'monitor', 'danger|warning');
  await reads(page, '#no-alerts', /^Contacts may go unreported\. Monitor: /);
  expect(await page.isDisabled('#release'), 'a release is offered without a hold');
  expect(/no hold/.test(await page.getAttribute('#release', 'title')), 'a disabled release does not show the reason');

  say({ type: 'hold' });
  await stands(page, 'stopping');
  await reads(page, '#explanation', /^Hold\. The head stops in \d+\.\d s, at \d+\.\d\d m of travel\.$/);
  await reads(page, '#outlook', /^Head stops in \d+\.\d s$/);
  expect((await page.getAttribute('#outlook-figure', 'data-level')) === 'far', 'a stop is shown as a contact');
  await stands(page, 'held');
  await page.click('#commands-tab');
  await reads(page, '#commands li', /ctlholdfrom tick \d/);
  await examine(page, 'commands');

  say({ type: 'resume' });
  await reads(page, '#commands li', /ctlresumerefused at tick [^:]+: the show is held/);
  say({ type: 'stop' });
  await stands(page, 'ended');
  await reads(page, '#word', /^ENDED$/);
  expect((await page.getAttribute('body', 'data-stripes')) === 'false', 'an orderly end is shown as an alarm');
  await page.waitForSelector('#hold:disabled');
  expect(/ended/.test(await page.getAttribute('#hold', 'title')), 'a disabled control does not show the reason');
  await page.waitForSelector('#pause:disabled');
  await examine(page, 'ended');
  say({ type: 'ended' });

  await stands(page, 'running');
  await reads(page, '#source', /^REPLAY$/);
  await page.waitForSelector('#source:visible');
  await page.waitForSelector('#hold:disabled');
  expect(/replays a recording/.test(await page.getAttribute('#hold', 'title')), 'a replay offers a hold');
  await examine(page, 'replay');
  expect(complaints.length === 0, complaints.join('\n'));
  say({ type: 'passed' });
});

function lamp(page, name, levels) {
  return page.waitForFunction(
    ([wanted, pattern]) =>
      new RegExp(`^(${pattern})$`).test(document.querySelector(`.lamp[data-name="${wanted}"]`)?.dataset.level ?? ''),
    [name, levels],
  );
}
