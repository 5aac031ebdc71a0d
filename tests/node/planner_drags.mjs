// The planner's page: a corner is dragged with the mouse and by keys, the contact follows, edits are undone, the text and the
// drawing follow each other, a draft survives, and a plan is saved. The test compares the saved file with `solve`.
//
//     node planner_drags.mjs URL FILE PICTURES-FOLDER

import fs from 'node:fs';
import path from 'node:path';

import { examine } from './accessible.mjs';
import { expect, openPage, reads, say, withBrowser } from './browser.mjs';
import { DRAGS, drag, newer, number, numbers, place, settled, text } from './planner_page.mjs';

const [address, file, pictures] = process.argv.slice(2);

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, address, { viewport: { width: 1280, height: 720 } });
  await settled(page);
  await page.screenshot({ path: path.join(pictures, 'opened.png') });
  const [opened, before] = [await text(page), await numbers(page)];
  expect(await page.isDisabled('#save'), 'there is nothing to save yet');
  await examine(page, 'opened');

  const from = await place(page, 'Corner 1');
  const taken_ms = await drag(page, from, { x: from.x - 40, y: from.y + 30 });
  await settled(page);
  const after = await numbers(page);
  const dragged = await place(page, 'Corner 1');
  expect(Math.hypot(dragged.x - from.x + 40, dragged.y - from.y - 30) < 1, 'the corner is under the hand');
  expect(after.Route !== before.Route && after['First contact'] !== before['First contact'], JSON.stringify([before, after]));
  expect((await text(page)).includes('# at the well'), 'the comments are kept');
  await page.screenshot({ path: path.join(pictures, 'dragged.png') });
  say({ type: 'dragged', before, after, p50_ms: taken_ms[DRAGS / 2], p95_ms: taken_ms[Math.floor(DRAGS * 0.95)] });

  // One drag is one step of undo.
  const changed = await text(page);
  await page.focus('#plan-area');
  await page.keyboard.press('Control+z');
  await settled(page);
  expect((await text(page)) === opened, 'one undo takes the drag back');
  await page.keyboard.press('Control+Shift+Z');
  await settled(page);
  expect((await text(page)) === changed, 'redo');

  // Keys move the chosen point.
  const still = await place(page, 'Corner 2');
  const asked = await number(page);
  await page.focus('#plan-area');
  await page.keyboard.press('Shift+ArrowUp');
  await newer(page, asked);
  await settled(page);
  const moved = await place(page, 'Corner 2');
  expect(Math.abs(moved.y_m - still.y_m - 1) < 0.005, `${still.y_m} ${moved.y_m}`);

  // A new corner, and its end.
  const corners = await page.locator('#point option').count();
  const [one, other] = [await place(page, 'Corner 1'), await place(page, 'Corner 2')];
  await drag(page, { x: (one.x + other.x) / 2, y: (one.y + other.y) / 2 }, { x: (one.x + other.x) / 2 + 20, y: (one.y + other.y) / 2 + 25 });
  // A dragged middle is a new corner.
  await page.waitForFunction((count) => document.querySelectorAll('#point option').length === count, corners + 1);
  await settled(page);
  await page.focus('#plan-area');
  await page.keyboard.press('Delete');
  await page.waitForFunction((count) => document.querySelectorAll('#point option').length === count, corners);
  await settled(page);

  // A bad text has its line, and the drawing stays.
  const good = await text(page);
  await page.fill('#text', good.replace('kind = "path"', 'kind = "pathe"'));
  const mistake = await reads(page, '#mistake', /^line \d+, /);
  expect(await page.isDisabled('#save'), 'a text with a mistake is not saved');
  await page.screenshot({ path: path.join(pictures, 'mistake.png') });
  await page.fill('#text', good);
  await page.waitForSelector('#mistake', { state: 'hidden' });
  await settled(page);

  // The draft survives a closed tab.
  await page.reload();
  await settled(page);
  expect((await text(page)) === good, 'the draft is back');
  await reads(page, '#notice-text', /not saved are back/);
  await page.emulateMedia({ colorScheme: 'dark' });
  await examine(page, 'with a notice, dark');
  await page.screenshot({ path: path.join(pictures, 'dark.png') });
  await page.keyboard.press('Control+s');
  await reads(page, '#saved', /^saved$/);
  const copy = path.join(path.dirname(file), 'saved.toml');
  fs.copyFileSync(file, copy);
  say({ type: 'saved', text: good, copy, mistake, numbers: await numbers(page) });

  // Another program changes the file.
  fs.appendFileSync(file, '# another program\n');
  await page.fill('#text', `${good}# more\n`);
  await settled(page);
  await page.click('#save');
  say({ type: 'refused', reason: await reads(page, '#saved', /has changed on the disk/) });
  await page.click('#save-as');
  await page.fill('#name', 'other.toml');
  await page.click('#name-form button[type=submit]');
  await reads(page, '#saved', /^saved$/);
  await reads(page, '#file', /^other\.toml$/);
  // The refusal is the page's own request, and the only complaint.
  expect(complaints.every((complaint) => complaint.includes('409')), complaints.join('\n'));
  say({ type: 'done', text: await text(page) });
});
