// Accessibility checks of a page by axe-core.

import { axeSource, expect } from './browser.mjs';

/** Fails with the violations that axe-core finds. Returns the number of rules that passed. */
export async function examine(page, where) {
  // The script is run through the debugging protocol, since the page's own policy forbids other scripts.
  await page.evaluate(axeSource);
  const { violations, passes } = await page.evaluate(() => axe.run());
  const found = violations.map(({ id, help, nodes }) => `${id}: ${help}\n${nodes.map((node) => node.html).join('\n')}`);
  expect(found.length === 0, `${where}: ${found.join('\n')}`);
  return passes.length;
}
