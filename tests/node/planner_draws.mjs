// The planner's page draws: a route through pressed corners, borders of the stage, a mirror image, a loop, a second dragon, an imported
// drawing, a picture underneath, a snap, a measure; with the mouse, by keys and with a finger.
//
//     node planner_draws.mjs URL FILE PICTURES-FOLDER

import fs from 'node:fs';
import path from 'node:path';

import { examine } from './accessible.mjs';
import { expect, openPage, reads, say, withBrowser } from './browser.mjs';
import { drawn, newer, number, place, screenOf, settled, text } from './planner_page.mjs';

const [address, file, pictures] = process.argv.slice(2);

/** Opens a menu and presses one of its entries. */
async function choose(page, menu, entry) {
  await page.click(`.drawing-tools button:text-is("${menu}")`);
  await page.click(`.menu:popover-open button:has-text("${entry}")`);
}

/** Zooms out until places of the plane are on the screen. */
async function seen(page, points) {
  await page.focus('#plan-area');
  const { x: left, y: top, width, height } = await page.locator('#plan-area').boundingBox();
  for (let tries = 0; tries < 20; tries += 1) {
    const all = await Promise.all(points.map((point) => screenOf(page, point)));
    if (all.every(({ x, y }) => x > left + 5 && x < left + width - 5 && y > top + 5 && y < top + height - 5)) return;
    await page.keyboard.press('-');
    await drawn(page);
  }
  throw new Error(`not on the screen: ${points}`);
}

/** Presses places of the plane, the last one twice. */
async function press(page, points) {
  await seen(page, points);
  for (const point of [...points, points.at(-1)]) {
    const { x, y } = await screenOf(page, point);
    await page.mouse.click(x, y);
    await drawn(page);
  }
}

/** Waits for the answer to what is done, and for all numbers. */
async function after(page, act) {
  const before = await number(page);
  await act();
  await newer(page, before);
  await settled(page);
}

/** Drops a file on the drawing. */
async function drop(page, name, type, content) {
  const transfer = await page.evaluateHandle(([name, type, base64]) => {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const transfer = new DataTransfer();
    transfer.items.add(new File([bytes], name, { type }));
    return transfer;
  }, [name, type, Buffer.from(content).toString('base64')]);
  await page.dispatchEvent('#plan-area', 'drop', { dataTransfer: transfer });
}

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, address, { viewport: { width: 1280, height: 720 } });
  await settled(page);
  await page.selectOption('#snap', '1');

  // A route through corners that are pressed; the grid takes them to whole metres.
  await choose(page, 'Route', 'Draw anew');
  await reads(page, '#pen-words', /Press the start/);
  await after(page, () => press(page, [[-12.3, 0.2], [8.2, -0.3], [7.8, 11.9], [-4.1, 12.2]]));
  const through = await text(page);
  expect(through.includes('start_x_m = -12') && through.includes('# all that we have'), through);
  const corner = await place(page, 'Corner 1');
  expect(Math.hypot(corner.x_m - 8, corner.y_m) < 0.002, JSON.stringify(corner));
  await page.screenshot({ path: path.join(pictures, 'drawn.png') });

  // A dragged corner snaps; with Alt it is free.
  await page.mouse.move(corner.x, corner.y);
  await page.mouse.down();
  await page.mouse.move(corner.x + 17, corner.y + 9, { steps: 4 });
  await page.mouse.up();
  await settled(page);
  const snapped = await place(page, 'Corner 1');
  expect([snapped.x_m, snapped.y_m].every((value) => Math.abs(value - Math.round(value)) < 0.002), JSON.stringify(snapped));

  // The stage, an area and the crowd.
  await choose(page, 'Stage', 'Draw the stage');
  await after(page, () => press(page, [[-16, -6], [14, -6], [14, 16], [-16, 16]]));
  await choose(page, 'Stage', 'area to keep out of');
  await after(page, () => press(page, [[-2, 4], [2, 4], [2, 8]]));
  await choose(page, 'Stage', 'line of the crowd');
  await after(page, () => press(page, [[-14, -5], [12, -5]]));
  const stage = await text(page);
  for (const key of ['outline = [[-16', 'keep_out = [[[-2', 'crowd = [[-14']) expect(stage.includes(key), stage);
  await reads(page, '#numbers', /Crowd/);
  await place(page, 'Keep out 1, point 1');
  await page.focus('#plan-area');
  await after(page, () => page.keyboard.press('Delete'));
  expect(!(await text(page)).includes('keep_out'), 'two points are no area');

  // A new point of a border: by a button, and by the middle of a side, which is dragged.
  const plain = await text(page);
  await place(page, 'Stage, point 1');
  await after(page, () => page.click('#add-point'));
  expect((await text(page)).includes('outline = [[-16.0, -6.0], [-1.0, -6.0], [14.0, -6.0]'), await text(page));
  await page.focus('#plan-area');
  await after(page, () => page.keyboard.press('Delete'));
  expect((await text(page)) === plain, 'the new point is taken out again');
  const side = await screenOf(page, [-1, -5]);
  await page.mouse.move(side.x, side.y);
  await page.mouse.down();
  await page.mouse.move(side.x, side.y + 30, { steps: 4 });
  await page.mouse.up();
  await settled(page);
  const bent = await place(page, 'Crowd, point 2');
  expect(Math.abs(bent.x_m + 1) < 0.002 && bent.y_m < -5.5, JSON.stringify(bent));
  await after(page, () => page.click('#undo'));
  expect((await text(page)) === plain, 'one undo takes the point out');

  // The whole route: mirrored, walked the other way, longer, closed.
  await after(page, () => choose(page, 'Route', 'Mirror'));
  const mirrored = await place(page, 'Corner 2');
  expect(mirrored.y_m < 0, JSON.stringify(mirrored));
  await after(page, () => choose(page, 'Route', 'Walk the other way'));
  await after(page, () => choose(page, 'Insert', 'Turnaround'));
  const longer = await text(page);
  await after(page, () => choose(page, 'Route', 'Close to a loop'));
  expect((await text(page)).includes('closed = true'), await text(page));
  await page.screenshot({ path: path.join(pictures, 'closed.png') });
  await after(page, () => page.click('#undo'));
  expect((await text(page)) === longer, 'one undo opens the loop');

  // A second dragon, which is chosen, dragged and removed.
  await after(page, () => choose(page, 'Route', 'Add a dragon'));
  await page.selectOption('#dragon', { label: 'silver' });
  await drawn(page);
  await page.screenshot({ path: path.join(pictures, 'dragons.png') });
  await examine(page, 'two dragons');
  await after(page, () => choose(page, 'Route', 'Remove this dragon'));
  expect(!(await text(page)).includes('silver'), await text(page));

  // By keys alone: a route of two lines.
  await page.focus('.drawing-tools button');
  await page.keyboard.press('Enter');
  await page.keyboard.press('Tab');
  await page.keyboard.press('Enter');
  await reads(page, '#pen-words', /Press the start/);
  for (const key of ['Enter', ...Array(12).fill('ArrowRight'), 'Enter', ...Array(9).fill('ArrowUp'), 'Enter']) await page.keyboard.press(key);
  await after(page, () => page.keyboard.press('Enter'));
  const typed = await place(page, 'End');
  const from = await place(page, 'Start');
  expect(Math.abs(typed.x_m - from.x_m - 12) < 0.002 && Math.abs(typed.y_m - from.y_m - 9) < 0.002, JSON.stringify([from, typed]));

  // A measure, which changes nothing.
  const measured = await text(page);
  await page.click('#ruler');
  await seen(page, [[0, 0], [3, 4]]);
  const { x, y } = await screenOf(page, [0, 0]);
  await page.mouse.click(x, y);
  const other = await screenOf(page, [3, 4]);
  await page.mouse.click(other.x, other.y);
  await reads(page, '#pen-words', /5\.000 m\./);
  await page.keyboard.press('Escape');
  expect((await text(page)) === measured, 'a measure changes nothing');

  // Drawings and tracks that are dropped.
  const svg = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 30"><path id="street" d="M0 0 L30 0 L30 20"/></svg>';
  await after(page, () => drop(page, 'street.svg', 'image/svg+xml', svg));
  const imported = await text(page);
  expect(imported.includes('file = "street.svg"'), imported);
  expect(fs.readFileSync(path.join(path.dirname(file), 'street.svg'), 'utf8') === svg, 'the file is in the folder');
  await reads(page, '#hint', /A drawing is changed in its file/);
  await after(page, () => drop(page, 'walk.csv', 'text/csv', 'x_m,y_m\n0,0\n20,0\n40,5\n60,20\n'));
  expect((await text(page)).includes('file = "walk.csv"'), await text(page));
  await drop(page, '../../secret.csv', 'text/csv', 'x_m,y_m\n0,0\n20,0\n');
  await drop(page, 'broken.svg', 'image/svg+xml', 'no drawing');
  const refused = await reads(page, '#line', /^Not possible: \[route\] file "broken\.svg"/);
  expect(!fs.existsSync(path.join(path.dirname(file), 'broken.svg')), 'a file that is no drawing is taken back');

  // A picture underneath, placed by two points, is there again after a reload.
  const png = await page.screenshot();
  await drop(page, 'square.png', 'image/png', png);
  await page.waitForSelector('[data-picture=remove]:not([disabled])', { state: 'attached' });
  await choose(page, 'Picture', 'Place it by two known points');
  await seen(page, [[0, 0], [10, 0]]);
  for (const point of [[0, 0], [10, 0]]) {
    const at = await screenOf(page, point);
    await page.mouse.click(at.x, at.y);
  }
  await page.fill('#bx', await page.inputValue('#ax'));
  await page.fill('#by', await page.inputValue('#ay'));
  await page.click('#picture-form button[type=submit]');
  const together = await page.$eval('#ax', (field) => field.validationMessage);
  expect(together.includes('must be apart'), `two points in one place: ${together}`);
  await page.fill('#bx', '20');
  await page.click('#picture-form button[type=submit]');
  await drawn(page);
  await page.screenshot({ path: path.join(pictures, 'picture.png') });
  await page.keyboard.press('Control+s');
  await reads(page, '#saved', /^saved$/);
  await page.reload();
  await settled(page);
  await page.waitForSelector('[data-picture=remove]:not([disabled])', { state: 'attached' });
  await choose(page, 'Picture', 'Remove it');
  await page.waitForSelector('[data-picture=remove][disabled]', { state: 'attached' });
  expect(complaints.every((complaint) => complaint.includes('400')), complaints.join('\n'));

  // A finger drags a point and draws a route.
  const finger = await openPage(browser, address, { viewport: { width: 1024, height: 768 }, hasTouch: true });
  await settled(finger.page);
  const touch = await finger.page.context().newCDPSession(finger.page);
  const start = await place(finger.page, 'Start');
  const move = (type, points) => touch.send('Input.dispatchTouchEvent', { type, touchPoints: points });
  const asked = await number(finger.page);
  await move('touchStart', [{ x: start.x + 6, y: start.y + 5 }]);
  for (let step = 1; step <= 5; step += 1) await move('touchMove', [{ x: start.x + 6 + step * 6, y: start.y + 5 }]);
  await move('touchEnd', []);
  await newer(finger.page, asked);
  await settled(finger.page);
  const dragged = await place(finger.page, 'Start');
  expect(dragged.x_m > start.x_m + 0.1, JSON.stringify([start, dragged]));
  // The end of the drag may reach the page after the menu has opened, and closes it.
  for (let isChosen = false; !isChosen;) {
    await finger.page.tap('.drawing-tools button:text-is("Route")');
    const choice = finger.page.tap('.menu:popover-open button:has-text("Draw anew")', { timeout: 5000 });
    isChosen = await choice.then(() => true, () => false);
  }
  await seen(finger.page, [[-5, 0], [5, 0]]);
  for (const point of [[-5, 0], [5, 0]]) {
    const at = await screenOf(finger.page, point);
    await finger.page.touchscreen.tap(at.x, at.y);
  }
  await after(finger.page, () => finger.page.tap('#pen-done'));
  expect((await text(finger.page)).includes('kind = "path"'), await text(finger.page));
  await finger.page.screenshot({ path: path.join(pictures, 'tablet.png') });
  await examine(finger.page, 'a tablet');
  expect(finger.complaints.length === 0, finger.complaints.join('\n'));
  say({ type: 'done', refused });
});
