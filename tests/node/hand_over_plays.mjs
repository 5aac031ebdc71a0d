// The page that `hand-over` writes, opened as a file: it loads nothing, plays, seeks, and draws every handle where the planner has it.
//
//     node hand_over_plays.mjs FILE-URL POSES.json two|paper

import { readFileSync } from 'node:fs';

import { examine } from './accessible.mjs';
import { expect, openPage, withBrowser } from './browser.mjs';

const [address, solved, kind] = process.argv.slice(2);
const { poses } = JSON.parse(readFileSync(solved, 'utf8'));

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, address);
  const requests = [];
  page.on('request', (request) => requests.push(request.url()));
  await page.reload();
  expect(requests.length === 1 && requests[0] === address, `the page loads ${requests}`);
  const stated = Number(/within ([\d.]+) mm/.exec(await page.textContent('header'))[1]) / 1000;
  expect(stated > 0 && stated < 0.01, `the page states ${stated} m`);

  for (const { time_s: time, handles } of poses) {
    const drawn = (await page.evaluate((at) => (player.seek(at), player.drawn()), time)).flat();
    expect(drawn.length === 2 * handles.length, `${drawn.length} numbers for ${handles.length} handles`);
    handles.forEach(({ x_m: x, y_m: y, index, dragon }, at) => {
      const off = Math.hypot(drawn[2 * at] - x, drawn[2 * at + 1] - y);
      // Places are 32-bit numbers.
      expect(off <= stated + 1e-5, `${dragon ?? ''} handle ${index} at ${time} s is ${off} m off, of ${stated} m`);
    });
    // The head's board is black on the canvas before a contact, and the board behind it has the dragon's colour.
    const colours = await page.evaluate(() => {
      // A copy, because reading often from the page's own canvas would slow it down.
      const plan = document.getElementById('plan');
      const pen = new OffscreenCanvas(plan.width, plan.height).getContext('2d', { willReadFrequently: true });
      pen.drawImage(plan, 0, 0);
      const colour = (handles, bench) => {
        const [x, y, toX, toY] = handles.slice(2 * bench, 2 * bench + 4);
        const [left, top] = player.toPixel((x + toX) / 2, (y + toY) / 2);
        return [...pen.getImageData(Math.round(left), Math.round(top), 1, 1).data].slice(0, 3);
      };
      return player.drawn().map((handles) => [colour(handles, 0), colour(handles, 3)]);
    });
    const expected = kind === 'two' ? [[0xc8, 0xa0, 0x4a], null] : [[0x56, 0xb4, 0xe9]];
    colours.forEach(([head, body], dragon) => {
      // From the first contact on, the two benches are red.
      const isRed = head[0] > 0xb0 && head[1] < 0x60 && head[2] < 0x60;
      const isRight = kind === 'paper' && time > 412.474 ? isRed : head.every((part) => part < 0x60);
      expect(isRight, `the head of ${dragon} at ${time} s is ${head}`);
      if (expected[dragon] !== null && kind === 'two') {
        const far = Math.max(...body.map((part, at) => Math.abs(part - expected[dragon][at])));
        expect(far < 0x30, `the body of ${dragon} at ${time} s is ${body}`);
      }
    });
  }

  // Cues and dragons have their names; a cue's button goes there.
  const cues = await page.locator('#cues button').allTextContents();
  const dragons = await page.locator('#dragons li').allTextContents();
  if (kind === 'two') {
    expect(cues.length === 2 && cues[0].includes('slow <b>') && cues[0].includes('lights & 14'), `the cues are ${cues}`);
    expect(cues[1].includes('waits for GO'), `the cues are ${cues}`);
    expect(dragons.join() === 'gold: 12 benches,silver: 7 benches', `the dragons are ${dragons}`);
    await page.locator('#cues button').nth(1).click();
    expect((await page.evaluate(() => player.now())) === 15, 'the cue is at 15 s');
    expect(await page.locator('#contact').isHidden(), 'there is no contact');
  } else {
    expect(cues.length === 0 && (await page.locator('#cues-part').isHidden()), `the cues are ${cues}`);
    await page.evaluate(() => player.seek(412));
    expect(await page.locator('#contact').isHidden(), 'the contact is later');
    await page.evaluate(() => player.seek(412.5));
    expect((await page.textContent('#contact')).includes('benches 0 and 8 touch at 412.474 s'), 'the contact is named');
  }

  // It plays faster than show time, and stops at the end. The scrubber and the keys seek.
  await page.locator('#seek').fill('2');
  expect((await page.evaluate(() => player.now())) === 2, 'the scrubber seeks');
  await page.locator('#seek').press('ArrowRight');
  expect((await page.evaluate(() => player.now())) === 3, 'the arrow seeks by a second');
  await page.locator('#speed').selectOption('50');
  await page.locator('#play').click();
  expect((await page.textContent('#play')) === 'Pause', 'it plays');
  await page.waitForFunction(() => player.now() > 4);
  if (kind === 'two') {
    await page.waitForFunction(() => document.getElementById('play').textContent === 'Play');
    const [now, end] = await page.evaluate(() => [player.now(), Number(document.getElementById('seek').max)]);
    expect(now === end, `it ends at ${now} of ${end}`);
  } else {
    await page.locator('#play').click();
    expect((await page.textContent('#play')) === 'Play', 'it pauses');
  }
  await page.locator('#nearer').click();
  await page.locator('#fit').click();
  await examine(page, 'handed over');
  for (const width of [1280, 390]) {
    await page.setViewportSize({ width, height: 760 });
    const over = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    expect(over <= 0, `the page is ${over} px wider than a window of ${width} px`);
  }
  expect(complaints.length === 0, complaints.join('\n'));
});
