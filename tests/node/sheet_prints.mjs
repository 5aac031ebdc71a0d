// The check sheet of a show in a browser: it prints on one page of A4, is readable by axe-core, and is the first page of the report.
//
//     node sheet_prints.mjs SHEET-URL REPORT-URL

import { examine } from './accessible.mjs';
import { expect, openPage, say, withBrowser } from './browser.mjs';

const [sheet, report] = process.argv.slice(2);

/** The number of pages of a document as it is printed. */
async function pages(page) {
  const pdf = await page.pdf({ preferCSSPageSize: true });
  return pdf.toString('latin1').match(/\/Type\s*\/Page\b/g)?.length ?? 0;
}

await withBrowser(async (browser) => {
  for (const width of [1280, 390]) {
    const { page, complaints } = await openPage(browser, sheet, { viewport: { width, height: 800 } });
    const over = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    expect(over <= 0, `the sheet is ${over} px wider than a window of ${width} px`);
    await examine(page, `sheet, ${width} px`);
    expect(complaints.length === 0, complaints.join('\n'));
    await page.context().close();
  }
  const alone = await openPage(browser, sheet);
  const onSheet = await pages(alone.page);
  const { page } = await openPage(browser, report);
  const kinds = await page.locator('.kind').allTextContents();
  await examine(page, 'report with a sheet');
  const whole = await pages(page);
  await page.evaluate(() => document.querySelector('.sheet').remove());
  say({ type: 'printed', sheet: onSheet, whole, without: await pages(page), kinds });
});
