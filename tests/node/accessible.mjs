// What axe-core finds on a page.

import { axeSource, expect } from './browser.mjs';

/** Fails with what axe-core finds, and returns how many of its rules applied. */
export async function examine(page, where) {
  // Through the protocol, as a debugger: the page's own policy lets no other script in.
  await page.evaluate(axeSource);
  const { violations, passes } = await page.evaluate(() => axe.run());
  const found = violations.map(({ id, help, nodes }) => `${id}: ${help}\n${nodes.map((node) => node.html).join('\n')}`);
  expect(found.length === 0, `${where}: ${found.join('\n')}`);
  return passes.length;
}
