// Two dragons on the screen: each in its colour, and nothing between the tail of the first and the head of the second.
//
//     node page_dragons.mjs URL

import { expect, openPage, reads, say, shown, stands, withBrowser } from './browser.mjs';

const [address] = process.argv.slice(2);

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, address);
  await stands(page, 'paused');
  const pair = await reads(page, '#pair', /gold/);
  const { camera } = await shown(page);
  const frame = await page.evaluate(async () => (await fetch('frame')).json());
  const [gold, silver] = frame.dragons.map(({ first_handle, benches }) =>
    frame.positions_m.slice(first_handle, first_handle + benches + 1),
  );
  const middle = ([ax, ay], [bx, by]) => [(ax + bx) / 2, (ay + by) / 2];
  // Beside the ring and the labels of the nearest pair.
  const places = [middle(gold[3], gold[4]), middle(silver[3], silver[4]), middle(gold[5], silver[0])];
  const colours = await page.evaluate(coloursAt, [camera, places]);
  const is = (colour, wanted) => colour.every((part, at) => Math.abs(part - wanted[at]) < 40);
  const [goldColour, silverColour] = [[0xc8, 0xa0, 0x4a], [0x00, 0x72, 0xb2]];
  const between = colours[2].some((colour) => is(colour, goldColour) || is(colour, silverColour));
  const has = (colours, wanted) => colours.some((colour) => is(colour, wanted));

  await page.keyboard.press('b');
  await page.keyboard.insertText('6');
  const details = await reads(page, '#bench-role', /of the body/);
  const { dragons } = await page.evaluate(() => ({ ...document.querySelector('#plan').dataset }));
  say({ dragons, pair, gold: has(colours[0], goldColour), silver: has(colours[1], silverColour), between, details });
  expect(complaints.length === 0, complaints.join('\n'));
});

/** The colours of the pixels around places of the plane. Runs in the page. */
function coloursAt([[x, y, scale], places]) {
  const plan = document.querySelector('#plan');
  const ratio = plan.width / plan.clientWidth;
  const { width, height } = plan;
  const { data } = plan.getContext('2d').getImageData(0, 0, width, height);
  const colour = (left, top) => [...data.subarray(4 * (top * width + left), 4 * (top * width + left) + 3)];
  return places.map(([px, py]) => {
    const left = Math.round(((px - x) * scale + plan.clientWidth / 2) * ratio);
    const top = Math.round(((y - py) * scale + plan.clientHeight / 2) * ratio);
    return Array.from({ length: 25 }, (_, at) => colour(left - 2 + (at % 5), top - 2 + Math.floor(at / 5)));
  });
}
