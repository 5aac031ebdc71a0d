// The planner's page offers the files that `hand-over` writes, made from the text as it is drawn.
//
//     node planner_hands_over.mjs URL FOLDER

import { readFileSync } from 'node:fs';
import path from 'node:path';

import { expect, openPage, withBrowser } from './browser.mjs';

const [url, folder] = process.argv.slice(2);

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, url);
  const download = async (name) => {
    await page.locator('#hand-over').click();
    const [taken] = await Promise.all([
      page.waitForEvent('download'),
      page.locator('#hand-over-menu button', { hasText: name }).click(),
    ]);
    expect(taken.suggestedFilename() === name, `the file is ${taken.suggestedFilename()}`);
    return readFileSync(await taken.path());
  };
  await page.waitForFunction(() => document.getElementById('text').value.includes('[route]'));
  for (const name of ['show.html', 'floor.dxf', 'benches.csv', 'poses.xlsx', 'plan.pdf']) {
    const same = readFileSync(path.join(folder, name)).equals(await download(name));
    expect(same, `${name} is the file of the command line`);
  }
  // A change that is not saved is in the file.
  await page.locator('#text').fill(`${await page.locator('#text').inputValue()}# changed\n[dragon]\nbenches = 3\n`);
  const sheets = (await download('benches.csv')).toString();
  expect(new Set(sheets.split('\n').slice(1, -1).map((row) => row.split(',')[1])).size === 3, sheets);
  // A file that cannot be made is refused with the reason.
  await page.locator('#text').fill('[dragon]\nbenches = 0\n');
  await page.locator('#hand-over').click();
  await page.locator('#hand-over-menu button', { hasText: 'plan.svg' }).click();
  await page.waitForFunction(() => /benches is 0/.test(document.getElementById('notice-text').textContent));
  const unexpected = complaints.filter((line) => !line.includes('422'));
  expect(unexpected.length === 0, unexpected.join('\n'));
});
