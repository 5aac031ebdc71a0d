// The planner's page asks the questions of `solve`: an answer is put into the plan and taken out again, a fix takes a problem away, a
// cancelled question ends its process, and a drag stays quick beside a question.
//
//     node planner_asks.mjs URL PICTURES-FOLDER PROCESS-OF-THE-PLANNER

import fs from 'node:fs';
import path from 'node:path';

import { examine } from './accessible.mjs';
import { expect, openPage, reads, say, withBrowser } from './browser.mjs';
import { drag, place, settled, text } from './planner_page.mjs';

const [address, pictures, planner] = process.argv.slice(2);

/** The command lines of the planner's processes that answer a question. */
function questions(word) {
  const lines = fs.readdirSync('/proc').filter((name) => /^\d+$/.test(name)).map((pid) => {
    try {
      return fs.readFileSync(`/proc/${pid}/cmdline`, 'utf8').split('\0');
    } catch {
      return [];
    }
  });
  return lines.filter((line) => line.includes('solve') && line.includes(word) && line[line.indexOf('--parent') + 1] === planner);
}

/** Waits until there are so many processes for a question. */
async function processes(word, count) {
  const until = Date.now() + 60_000;
  while (questions(word).length !== count) {
    expect(Date.now() < until, `waited until ${count} processes answer ${word}`);
    await new Promise((done) => setTimeout(done, 20));
  }
}

const ask = async (page, name) => {
  if (await page.isVisible('#ask-back')) await page.click('#ask-back');
  await page.click(`#ask-questions button:has-text("${name}")`);
};

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, address, { viewport: { width: 1280, height: 720 } });
  await settled(page);
  const opened = await text(page);

  // A fix, and back.
  const fix = page.locator('.fixes button', { hasText: /^pitch / });
  await fix.waitFor();
  await page.screenshot({ path: path.join(pictures, 'fixes.png') });
  await examine(page, 'fixes');
  const word = await fix.textContent();
  await fix.click();
  await reads(page, '#numbers', /First contactnone/);
  await settled(page);
  const fixed = await text(page);
  await page.click('#undo');
  await settled(page);
  expect((await text(page)) === opened, 'one undo takes the fix back');

  // A question, its answer in the plan, and back.
  await page.click('#ask-tab');
  await page.screenshot({ path: path.join(pictures, 'questions.png') });
  await ask(page, 'Smallest pitch');
  await page.click('#ask-go');
  const answer = await reads(page, '#ask-words', /smallest pitch/);
  await page.screenshot({ path: path.join(pictures, 'answer.png') });
  await examine(page, 'an answer');
  await page.click('#ask-put');
  await reads(page, '#ask-put', /^Take it out again$/);
  await settled(page);
  const put = await text(page);
  expect(put !== opened && put.includes('# narrow'), put);
  await page.click('#ask-put');
  await settled(page);
  expect((await text(page)) === opened, 'the answer is taken out again');

  // A question that is wrong here.
  await ask(page, 'Earliest starts');
  await page.click('#ask-go');
  const refused = await reads(page, '#ask-state', /must have 2 or more/);

  // Flags have the names of the page.
  await ask(page, 'Turn');
  await page.click('#ask-go');
  await reads(page, '#ask-state', /“circle”, “ratio of radii” or “pitch” makes it one/);

  // A cancelled question ends its process; a newer one takes the place of an older one.
  // That of a long dragon takes ten minutes of a core, far longer than the drag also on a busy machine.
  await page.click('#edit-tab');
  await page.fill('#text', opened.replace('benches = 40', 'benches = 4000').replace('end_s = 360.0\n', ''));
  await page.click('#ask-tab');
  await ask(page, 'Sensitivity');
  await page.fill('#ask-options input[name=steps]', '100');
  await page.fill('#ask-options input[name=work]', '1000000');
  await page.click('#ask-go');
  await processes('sensitivity', 1);
  await reads(page, '#ask-state', /% done/);
  await page.click('#edit-tab');
  await page.click('#undo');
  await settled(page);
  expect((await text(page)) === opened, 'the question goes on while the plan is another one');
  const from = await place(page, 'Pitch');
  const beside_ms = await drag(page, from, { x: from.x + 3, y: from.y });
  expect(questions('sensitivity').length === 1, 'the question is under way during the drag');
  await page.click('#undo');
  await page.click('#ask-tab');
  await page.click('#ask-cancel');
  await reads(page, '#ask-state', /^cancelled$/);
  await processes('sensitivity', 0);
  await page.click('#ask-go');
  await processes('sensitivity', 1);
  await ask(page, 'Swept floor');
  await page.click('#ask-go');
  await reads(page, '#ask-words', /m²/);
  await processes('sensitivity', 0);

  // The question of a closed page ends, too.
  await ask(page, 'Sensitivity');
  await page.fill('#ask-options input[name=steps]', '100');
  await page.click('#ask-go');
  await processes('sensitivity', 1);
  expect(complaints.length === 0, complaints.join('\n'));
  await page.close();
  await processes('sensitivity', 0);
  say({ type: 'done', opened, word, fixed, answer, put, refused, beside_p95_ms: beside_ms[Math.floor(beside_ms.length * 0.95)] });
});
