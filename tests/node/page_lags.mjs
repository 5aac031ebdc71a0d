// A network that becomes slower and slower: the page shows the age of its picture and loses its colour, and gets it back. The
// network is a proxy in front of the view. Its delay grows by less than time passes, so the page is never without messages.
//
//     node page_lags.mjs URL

import { once } from 'node:events';
import net from 'node:net';
import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

const view = new URL(process.argv[2]);
/** Milliseconds of delay per millisecond since the network became slow, and the greatest delay. */
const GROWTH = 0.5;
const MOST_MS = 4700;
let slow_since_ms = null;

const proxy = net.createServer((page) => {
  const upstream = net.connect(Number(view.port), view.hostname);
  for (const socket of [page, upstream]) socket.on('error', () => socket.destroy());
  page.on('close', () => upstream.destroy());
  page.pipe(upstream);
  upstream.on('data', (bytes) => setTimeout(() => page.writable && page.write(bytes), delay_ms()));
  upstream.on('end', () => setTimeout(() => page.end(), delay_ms()));
});
proxy.listen(0, '127.0.0.1');
await once(proxy, 'listening');

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, `http://127.0.0.1:${proxy.address().port}/${view.hash}`);
  await stands(page, 'running');
  slow_since_ms = performance.now();
  await stands(page, 'old');
  await reads(page, '#explanation', /^Picture 4\.\d s old: the network is slow\. It shows the show running\. Use the wired stop\.$/);
  expect((await page.evaluate(() => document.body.dataset.live)) === 'false', 'an old picture looks live');
  const [ground, green] = await page.evaluate(() => {
    const probe = document.body.appendChild(document.createElement('i'));
    probe.style.color = 'var(--running)';
    return [getComputedStyle(document.querySelector('.strip')).backgroundColor, getComputedStyle(probe).color];
  });
  expect(ground !== green, 'an old picture is green');
  expect(await page.isEnabled('#hold'), 'an old picture has no hold');
  say({ type: 'old' });
  slow_since_ms = null;
  await stands(page, 'running');
  expect(complaints.length === 0, complaints.join('\n'));
});
proxy.close();
say({ type: 'passed' });

function delay_ms() {
  return slow_since_ms === null ? 0 : Math.min((performance.now() - slow_since_ms) * GROWTH, MOST_MS);
}
