// A finished show keeps the near misses and the contact of its plan, although the head was faster than planned.
//
//     node page_keeps_plan.mjs URL

import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, process.argv[2]);
  await stands(page, 'finished');
  const summary = await reads(page, '#timeline-reading', /^planned: .*contact/);
  say({ summary });
  expect(complaints.length === 0, complaints.join('\n'));
});
