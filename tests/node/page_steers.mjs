// Every control, by button and by key. After each, the test compares the bus.
//
//     node page_steers.mjs URL

import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, process.argv[2]);
  await stands(page, 'running');
  expect(!page.url().includes('token'), `the token is still in the address: ${page.url()}`);

  await page.click('#pause');
  await came(page, 'paused', /^paused from tick \d+$/);
  await page.click('#pause');
  await came(page, 'running', /^resumed from tick \d+$/);
  await page.click('h1');
  await page.keyboard.press('Space');
  await came(page, 'paused', /^paused from tick \d+$/);
  await page.keyboard.press('Control+h');
  await page.locator('#seek-field').press('h');
  await page.click('h1');
  await page.keyboard.press('Space');
  await came(page, 'running', /^resumed from tick \d+$/);

  await page.keyboard.press('h');
  await came(page, 'held', /^held from tick \d+$/);
  await page.keyboard.press('Space');
  await came(page, 'held', /^paused from tick \d+$|^pause refused: /);
  await page.click('#release');
  await reads(page, '#release-word', /again/);
  await page.click('#release');
  await reads(page, '#reply', /^released from tick \d+$/);
  await page.click('#hold');
  await came(page, 'held', /^held from tick \d+$/);
  await page.click('h1');
  await page.keyboard.press('Shift+R');
  await reads(page, '#reply', /^released from tick \d+$/);
  say({ type: 'released' });

  await seek(page);
  await page.fill('#speed-field', '0.5');
  await page.press('#speed-field', 'Enter');
  await reads(page, '#reply', /^new speed from tick \d+$/);
  await reads(page, '#speed', /^0\.50$|^0\.00$/);
  say({ type: 'speed' });
  await page.fill('#speed-field', '11');
  await page.click('#speed-form button');
  expect(await page.$eval('#speed-field', (field) => !field.checkValidity()), 'a head speed of 11 m/s is none');
  expect(complaints.length === 0, complaints.join('\n'));
});

/** Waits for a state and a reply, and has the test look at the bus. */
async function came(page, status, reply) {
  await stands(page, status);
  say({ type: status, reply: await reads(page, '#reply', reply) });
}

/** The timeline proposes a time, by pointer and by keyboard; only the button seeks. */
async function seek(page) {
  const { x, y, width, height } = await page.locator('#timeline-area').boundingBox();
  await page.mouse.click(x + width / 2, y + height / 2);
  const proposed = Number(await page.inputValue('#seek-field'));
  expect(proposed > 150 && proposed < 280, `half of the show is not at ${proposed} s`);
  await page.keyboard.press('ArrowRight');
  const stepped = Number(await page.inputValue('#seek-field'));
  expect(stepped === Math.round(proposed) + 1, `${stepped} s does not follow ${proposed} s`);
  say({ type: 'proposed', time_s: stepped });
  await page.click('#seek-form button');
  await reads(page, '#reply', /^put there from tick \d+$/);
  say({ type: 'sought', time_s: stepped });
}
