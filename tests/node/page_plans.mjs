// The timeline shows the planned clearance of the whole show, and a summary of the plan.
//
//     node page_plans.mjs URL

import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

await withBrowser(async (browser) => {
  for (const viewport of [
    { width: 1280, height: 800 },
    { width: 390, height: 844 },
  ]) {
    const { page, complaints } = await openPage(browser, process.argv[2], { viewport });
    await stands(page, 'paused');
    const summary = await reads(page, '#timeline-reading', /^planned: .*contact at/);
    const flags = JSON.parse(await page.getAttribute('#timeline-area', 'data-flags'));
    expect(flags[0].text.startsWith('now ') && flags[1].text.startsWith('contact '), JSON.stringify(flags));
    for (const [at, one] of flags.entries()) {
      for (const other of flags.slice(at + 1)) {
        const areApart = one.row !== other.row || one.left + one.wide <= other.left || other.left + other.wide <= one.left;
        expect(areApart, `flags overlap: ${JSON.stringify([one, other])}`);
      }
    }
    const points = Number(await page.getAttribute('#timeline-area', 'data-planned-points'));
    const ahead = await drawnAhead(page);
    say({ summary, flags: flags.map(({ text }) => text), points, ahead });
    expect(complaints.length === 0, complaints.join('\n'));
  }
});

/** The share of the columns in the timeline's right half that contain the planned line's colour. */
function drawnAhead(page) {
  return page.evaluate(() => {
    const canvas = document.querySelector('#timeline');
    const { width, height } = canvas;
    const { data } = canvas.getContext('2d').getImageData(0, 0, width, height);
    const probe = document.body.appendChild(document.createElement('i'));
    probe.style.color = 'var(--edge)';
    const edge = getComputedStyle(probe).color.match(/\d+/g).map(Number);
    let columns = 0;
    for (let x = Math.ceil(width / 2); x < width; x += 1) {
      const isLine = (y) => edge.every((part, at) => Math.abs(data[(y * width + x) * 4 + at] - part) < 40);
      if (Array.from({ length: height }, (_, y) => y).some(isLine)) columns += 1;
    }
    return columns / (width / 2);
  });
}
