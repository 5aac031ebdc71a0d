// The report of a show in a browser: it opens without an error, runs nothing that its words contain, has its headings and its
// pictures, fits a phone, and is readable by axe-core.
//
//     node report_reads.mjs FILE-URL TITLE

import { examine } from './accessible.mjs';
import { expect, openPage, say, withBrowser } from './browser.mjs';

const [address, title] = process.argv.slice(2);
const HEADINGS = [
  'Nearest approach',
  'Holds',
  'Restarts',
  'Recordings',
  'Timeline',
  'Alerts',
  'Commands',
  'Lateness',
  'Machine',
  'Versions',
  'Configuration',
];

await withBrowser(async (browser) => {
  for (const width of [1280, 390]) {
    const { page, complaints } = await openPage(browser, address, { viewport: { width, height: 800 } });
    expect((await page.textContent('h1')) === title, `the title is ${await page.textContent('h1')}`);
    const headings = await page.locator('h2').allTextContents();
    expect(headings.join() === HEADINGS.join(), `the headings are ${headings}`);
    const pictures = await page.evaluate(() =>
      Promise.all([...document.images].map((image) => image.decode().then(() => image.naturalWidth, String))),
    );
    expect(pictures.length === 2 && pictures.every((wide) => wide > 100), `the pictures are ${pictures}`);
    expect((await page.locator('script, link, iframe, object').count()) === 0, 'the report has more than words');
    const over = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    expect(over <= 0, `the report is ${over} px wider than a window of ${width} px`);
    await examine(page, `report, ${width} px`);
    expect(complaints.length === 0, complaints.join('\n'));
    await page.context().close();
  }
  const { page } = await openPage(browser, address);
  const pdf = await page.pdf({ preferCSSPageSize: true });
  say({ type: 'printed', bytes: pdf.length });
});
