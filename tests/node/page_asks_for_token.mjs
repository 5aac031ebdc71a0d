// Off loopback, viewing needs the token too. A page without it asks for the address, and connects with the one entered. The
// scenario runs in a network namespace of its own, in which it starts the view itself.
//
//     node page_asks_for_token.mjs PROGRAM INSTANCE ADDRESS

import { spawn } from 'node:child_process';
import readline from 'node:readline';
import { examine } from './accessible.mjs';
import { expect, occurs, openPage, reads, say, stands, withBrowser } from './browser.mjs';

const [program, instance, listen] = process.argv.slice(2);
const args = ['view', '--format', 'json', '--instance', instance, '--listen', listen];
const view = spawn(program, args, { stdio: ['ignore', 'pipe', 'ignore'] });
const [line] = await occurs(readline.createInterface({ input: view.stdout }), 'line', 'the view prints its address');
const { url } = JSON.parse(line);

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, url.replace(/#.*/, ''));
  await stands(page, 'refused');
  await reads(page, '#explanation', /needs the address with the token/);
  for (const colorScheme of ['light', 'dark']) {
    await page.emulateMedia({ colorScheme });
    await examine(page, `${colorScheme}, refused`);
  }
  await page.fill('#token-field', 'nonsense');
  await page.press('#token-field', 'Enter');
  await page.fill('#token-field', url);
  await page.press('#token-field', 'Enter');
  await stands(page, 'running');
  expect(await page.isEnabled('#hold'), 'with the token, the controls are disabled');
  expect(await page.isHidden('#token-notice'), 'the page asks for a token that it already has');

  const given = await openPage(browser, url);
  await stands(given.page, 'running');
  // Chromium warns on each page without TLS that it ignores this header.
  const ours = [...complaints, ...given.complaints].filter((one) => !one.includes('Cross-Origin-Opener-Policy'));
  expect(ours.length === 0, ours.join('\n'));
});
view.kill('SIGTERM');
const [status] = await occurs(view, 'exit', 'the view has ended');
expect(status === 0, `the view ended with status ${status}`);
say({ type: 'passed' });
