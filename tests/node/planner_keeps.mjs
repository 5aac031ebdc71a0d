// Nothing is lost on the planner's page: two tabs have drafts of their own, a save over a newer file offers a choice, and a draft survives
// a killed program. All sizes of screens hold the page.
//
//     node planner_keeps.mjs URL FILE PICTURES-FOLDER

import fs from 'node:fs';
import path from 'node:path';

import { examine } from './accessible.mjs';
import { expect, openPage, reads, say, withBrowser } from './browser.mjs';
import { settled, text } from './planner_page.mjs';

const [address, file, pictures] = process.argv.slice(2);
const SIZES = [[1280, 720], [1920, 1080], [2560, 1440], [3840, 2160], [820, 1180]];

/** Waits for a line of the test. */
const line = () => new Promise((done) => process.stdin.once('data', () => done(process.stdin.destroy())));

await withBrowser(async (browser) => {
  const { page } = await openPage(browser, address, { viewport: { width: 1280, height: 720 } });
  await settled(page);
  const opened = await text(page);
  const other = await page.context().newPage();
  await other.goto(address);
  await settled(other);

  // Each tab has its own draft, also after a reload.
  await page.fill('#text', `${opened}# one\n`);
  await other.fill('#text', `${opened}# two\n`);
  await Promise.all([settled(page), settled(other)]);
  await page.reload();
  await other.reload();
  await Promise.all([settled(page), settled(other)]);
  expect((await text(page)).endsWith('# one\n') && (await text(other)).endsWith('# two\n'), 'each tab has its own draft');

  // The second that saves gets a choice.
  await page.click('#save');
  await reads(page, '#saved', /^saved$/);
  await other.click('#save');
  await reads(other, '#notice-text', /newer than what this page began with/);
  expect(fs.readFileSync(file, 'utf8').endsWith('# one\n'), 'the first one is not overwritten');
  await other.screenshot({ path: path.join(pictures, 'choice.png') });
  await examine(other, 'a choice');
  await other.click('#notice-buttons button:has-text("Take the newer file")');
  await settled(other);
  expect((await text(other)).endsWith('# one\n'), 'the newer file');
  await other.click('#undo');
  await settled(other);
  expect((await text(other)).endsWith('# two\n'), 'and its own text by undo');
  await other.click('#save');
  await reads(other, '#saved', /^saved$/);

  // A closed tab leaves its draft to the next one that opens.
  await other.fill('#text', `${opened}# three\n`);
  await settled(other);
  await other.close();
  const next = await page.context().newPage();
  await next.goto(address);
  await settled(next);
  await reads(next, '#notice-text', /not saved are back/);
  expect((await text(next)).endsWith('# three\n'), await text(next));
  await next.check('#ghost');

  // The program is killed, and starts again.
  say({ type: 'kill' });
  await reads(next, '#line', /does not answer/);
  await next.fill('#text', `${opened}# four\n`);
  await next.press('#text', 'Control+s');
  await reads(next, '#saved', /does not answer/);
  say({ type: 'start' });
  await line();
  await next.waitForFunction(() => document.querySelector('#line').hidden);
  await settled(next);
  expect((await text(next)).endsWith('# four\n'), 'the draft is still there');
  await reads(next, '#saved', /changed, not saved/);
  await next.click('#save');
  await reads(next, '#saved', /^saved$/);

  for (const [width, height] of SIZES) {
    await next.setViewportSize({ width, height });
    await settled(next);
    const over = await next.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    expect(over <= 0, `${width} × ${height}: the page is ${over} px too wide`);
    await examine(next, `${width} × ${height}`);
    await next.screenshot({ path: path.join(pictures, `size-${width}.png`) });
  }
  const done = await text(next);

  // A tab that has saved under another name stays with that file, also after a reload, and a file that is gone can be written again.
  await next.setViewportSize({ width: 1280, height: 720 });
  const another = path.join(path.dirname(file), 'another.toml');
  await next.click('#save-as');
  await next.fill('#name', 'another.toml');
  await next.press('#name', 'Enter');
  await reads(next, '#file', /^another\.toml$/);
  await next.reload();
  await settled(next);
  await reads(next, '#file', /^another\.toml$/);
  fs.rmSync(another);
  await next.fill('#text', `${opened}# five\n`);
  await settled(next);
  await next.click('#save');
  await reads(next, '#notice-text', /another\.toml is no longer there/);
  await next.click('#notice-buttons button:has-text("Write it again")');
  await reads(next, '#saved', /^saved$/);
  expect(fs.readFileSync(another, 'utf8').endsWith('# five\n'), 'it is written again');
  expect(fs.readFileSync(file, 'utf8') === done, 'and the first file stays');
  fs.rmSync(another);
  say({ type: 'done', text: done });
});
