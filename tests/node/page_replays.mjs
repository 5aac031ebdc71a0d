// A replay on the page: its alerts and commands, and the bar that plays, scrubs and changes the pace.
//
//     node page_replays.mjs URL FOLDER

import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

const SIZES = { wide: [1600, 1000], small: [1280, 720], phone: [390, 844] };

await withBrowser(async (browser) => {
  const [, , url, folder] = process.argv;
  const { page, complaints } = await openPage(browser, url);
  await stands(page, 'paused');
  await page.waitForSelector('#replay-bar:not([hidden])');
  await reads(page, '.replay-word', /^REPLAY$/);
  await reads(page, '#replay-play', /^Play$/);
  expect(await page.isHidden('#seek-form'), 'a replay is sought by its bar alone');

  const length_s = await page.$eval('#replay-position', (slider) => Number(slider.max));
  expect(length_s > 2, `the recording has a length of ${length_s} s`);
  await page.selectOption('#replay-pace', '0.5');
  await scrub(page, 0.25);
  await page.waitForFunction(() => Number(document.getElementById('replay-position').value) > 0.2);
  await stands(page, 'paused');
  say({ type: 'sought', position_s: 0.25, length_s });

  await page.click('#replay-play');
  await stands(page, 'running');
  await reads(page, '#replay-play', /^Pause$/);
  await page.waitForSelector('#alerts [data-kind="contact"]');
  say({ type: 'told' });

  await stands(page, 'finished');
  await reads(page, '#replay-time', /at the end$/);
  await page.focus('#replay-position');
  await page.keyboard.press('Home');
  await page.waitForFunction(() => document.body.dataset.status === 'running');
  // From the beginning, so that no command is before the position.
  await page.click('#commands-tab');
  await reads(page, '#commands', /speed 1.1 m\/s/);
  await reads(page, '#commands', /release/);
  await page.click('#replay-play');
  await stands(page, 'paused');
  expect(complaints.length === 0, complaints.join('\n'));
  for (const [name, [width, height]] of Object.entries(SIZES)) {
    await page.setViewportSize({ width, height });
    await page.screenshot({ path: `${folder}/replay-${name}.png` });
    const box = await page.$eval('#replay-bar', (bar) => ({ inside: bar.scrollWidth <= bar.clientWidth + 1 }));
    expect(box.inside, `the bar is wider than the page at ${width} pixels`);
  }
  say({ type: 'passed' });
});

/** Drags the slider to a position in seconds. */
async function scrub(page, position_s) {
  await page.$eval(
    '#replay-position',
    (slider, value) => {
      slider.value = String(value);
      slider.dispatchEvent(new Event('input', { bubbles: true }));
    },
    position_s,
  );
}
