// The dragon on the screen: it moves. When paused, the scenario writes the picture and the numbers, which the test compares
// with the bus.
//
//     node page_draws.mjs URL PIXELS

import fs from 'node:fs';
import { expect, openPage, say, shown, stands, withBrowser } from './browser.mjs';

const [address, pixels] = process.argv.slice(2);

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, address);
  await stands(page, 'running');
  const first = await shown(page);
  const before = await picture(page);
  await page.waitForFunction((tick) => Number(document.querySelector('#plan').dataset.tick) > tick, first.tick);
  await page.waitForFunction((old) => document.querySelector('#plan').toDataURL() !== old, before);

  await page.keyboard.press('Space');
  await stands(page, 'paused');
  say({ type: 'picture', ...(await shown(page)), ...(await writePixels(page)) });

  await page.keyboard.press('b');
  // Both digits are inserted at once, since the details of bench 1 would appear after the first one.
  await page.keyboard.insertText('17');
  await page.waitForSelector('#bench-centre:visible');
  const texts = ['role', 'centre', 'heading', 'front'].map((name) => page.textContent(`#bench-${name}`));
  say({ type: 'bench', details: await Promise.all(texts) });
  expect(complaints.length === 0, complaints.join('\n'));
});

function picture(page) {
  return page.evaluate(() => document.querySelector('#plan').toDataURL());
}

/**
 * Writes the plan as red, green, blue and alpha. Returns its size, its camera, and the colours of the wood, the head and the ground.
 * A line of text that comes or goes changes the plan's size; it is drawn anew in the picture after that.
 */
async function writePixels(page) {
  const { base64, ...sizes } = await page.evaluate(async () => {
    const plan = document.querySelector('#plan');
    const drawn = () => `${plan.width} ${plan.height} ${plan.dataset.camera}`;
    for (let before = ''; before !== drawn(); ) {
      before = drawn();
      for (let pictures = 0; pictures < 3; pictures += 1) await new Promise(requestAnimationFrame);
    }
    const { width, height } = plan;
    const camera = plan.dataset.camera.split(' ').map(Number);
    const { data } = plan.getContext('2d').getImageData(0, 0, width, height);
    let binary = '';
    for (let at = 0; at < data.length; at += 32768) binary += String.fromCharCode(...data.subarray(at, at + 32768));
    const probe = document.body.appendChild(document.createElement('i'));
    const colour = (name) => {
      probe.style.color = `var(--${name})`;
      return getComputedStyle(probe).color.match(/\d+/g).map(Number);
    };
    return { base64: btoa(binary), width, height, camera, wood: colour('wood'), head: colour('head'), ground: colour('halo') };
  });
  fs.writeFileSync(pixels, Buffer.from(base64, 'base64'));
  return sizes;
}
