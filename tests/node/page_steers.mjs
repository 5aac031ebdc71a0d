// Every control, by button and by key. After each one, the test compares the bus.
//
//     node page_steers.mjs URL

import { asks, confirm, expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

const WAYS_TO_HOLD = [
  (page) => page.click('#hold'),
  (page) => page.press('#seek-field', 'h'),
  (page) => page.keyboard.press('Shift+H'),
  async (page) => {
    await page.keyboard.press('?');
    await page.waitForSelector('#shortcuts[open]');
    await page.keyboard.press('h');
    await page.keyboard.press('Escape');
  },
];

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(browser, process.argv[2]);
  await stands(page, 'running');
  expect(!page.url().includes('token'), `the token is still in the address: ${page.url()}`);

  await page.click('#pause');
  await came(page, 'paused', /^paused from tick \d+$/);
  await page.click('#pause');
  await came(page, 'running', /^resumed from tick \d+$/);
  await page.click('h1');
  await page.keyboard.press('Space');
  await came(page, 'paused', /^paused from tick \d+$/);
  await keysThatAreNotOurs(page);
  await page.keyboard.press('Space');
  await came(page, 'running', /^resumed from tick \d+$/);

  await page.keyboard.press('h');
  await came(page, 'held', /^held from tick \d+$/);
  await page.keyboard.press('Space');
  await came(page, 'held', /^paused from tick \d+$|^pause refused: /);
  await confirm(page, '#release', '#release-word', /again/, /^released from tick \d+$/);
  await reads(page, '#commands li b', /^page@localhost$/);
  // The next hold is recognised by the change of state.
  await page.waitForFunction(() => document.body.dataset.status !== 'held');
  for (const hold of WAYS_TO_HOLD) {
    await hold(page);
    await came(page, 'held', /^held from tick \d+$/);
    await page.click('h1');
    await page.keyboard.press('Shift+R');
    await reads(page, '#release-word', /again/);
    await page.keyboard.press('Shift+R');
    await reads(page, '#reply', /^released from tick \d+$/);
    await page.waitForFunction(() => document.body.dataset.status !== 'held');
  }
  say({ type: 'released' });

  await seek(page);
  if ((await page.getAttribute('body', 'data-status')) === 'paused') await page.click('#pause');
  await stands(page, 'running');
  await page.fill('#speed-field', '0.5');
  await page.press('#speed-field', 'Enter');
  await reads(page, '#reply', /^new speed from tick \d+$/);
  await reads(page, '#speed', /^0\.50$/);
  say({ type: 'speed', head_speed_mps: 0.5 });
  await page.fill('#speed-field', '11');
  await page.click('#speed-form button');
  expect(await page.$eval('#speed-field', (field) => !field.checkValidity()), 'a head speed of 11 m/s is accepted');
  expect(complaints.length === 0, complaints.join('\n'));

  await showsTheOutcomeOfEachCommand(page);
});

/** Waits for a state and a reply, and reports them, so that the test checks the bus. */
async function came(page, status, reply) {
  await stands(page, status);
  say({ type: status, reply: await reads(page, '#reply', reply) });
}

/** Keys that must send no command. A command writes a reply at once, so an unchanged reply proves that none was sent. */
async function keysThatAreNotOurs(page) {
  const reply = await page.textContent('#reply');
  const pressed = async (where, key) => {
    await page.locator(where).press(key);
    expect((await page.textContent('#reply')) === reply, `${key} on ${where} sends a command`);
  };
  await pressed('body', 'Control+h');
  const theme = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  await pressed('#theme', 'Space');
  const other = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  expect(theme !== other, 'the focused button is not pressed');
  await pressed('#theme', 'Space');

  const isTaken = (id) =>
    page.$eval(id, (target) => {
      const arrow = new KeyboardEvent('keydown', { key: 'ArrowLeft', bubbles: true, cancelable: true });
      return !target.dispatchEvent(arrow);
    });
  expect(await isTaken('#plan-area'), 'an arrow on the plan does not pan');
  expect(!(await isTaken('#help')), 'an arrow pans although the plan has no focus');

  await page.click('#help');
  await page.uncheck('#keys-are-on');
  await page.keyboard.press('Escape');
  await page.click('h1');
  for (const key of ['h', 'Space', '?']) await pressed('body', key);
  expect(await page.isHidden('#shortcuts'), 'a disabled key opens the list');
  await page.reload();
  await stands(page, 'paused');
  await page.click('#help');
  expect(!(await page.isChecked('#keys-are-on')), 'the choice is lost');
  await page.check('#keys-are-on');
  await page.keyboard.press('Escape');
  await page.waitForSelector('#pause:enabled');
  await page.click('h1');
}

/** The timeline proposes a time, by pointer and by keyboard. Only the button seeks. */
async function seek(page) {
  const field = page.locator('#seek-field');
  const { x, y, width, height } = await page.locator('#timeline-area').boundingBox();
  const choose = () => page.mouse.click(x + width / 2, y + height / 2);
  await choose();
  for (const end of ['End', 'Home']) {
    await page.keyboard.press(end);
    expect(await field.evaluate((one) => one.checkValidity()), `${end}: ${await field.inputValue()} s is out of range`);
  }
  await choose();
  const proposed = Number(await field.inputValue());
  expect(proposed > 150 && proposed < 280, `half of the show is not at ${proposed} s`);
  await page.keyboard.press('ArrowRight');
  const stepped = Number(await field.inputValue());
  expect(stepped === Math.round(proposed) + 1, `${stepped} s does not follow ${proposed} s`);
  say({ type: 'proposed', time_s: stepped });
  await asks(page, '#seek-set', '#seek-set', /^Sure\?$/);
  await reads(page, '#reply', /^Press again to seek: the dragon jumps to \d+\.\d s/);
  await field.fill(String(stepped));
  await reads(page, '#seek-set', /^Set$/);
  await confirm(page, '#seek-set', '#seek-set', /^Sure\?$/, /^new show time from tick \d+$/);
  say({ type: 'sought', time_s: stepped });
}

/** A reply reports a refusal only if the command was refused, and a later command does not hide a failed hold. */
async function showsTheOutcomeOfEachCommand(page) {
  const answers = [
    [200, { accepted: false, reason: 'it is over' }, /^hold refused: it is over$/],
    [403, { error: 'not from there' }, /^hold refused: not from there$/],
    [409, { error: 'a later hold cancelled it' }, /^hold: a later hold cancelled it$/],
    [429, { error: 'too many' }, /^hold: too many$/],
    [504, { error: 'it may have accepted the command' }, /^hold: no answer: it may have accepted the command$/],
  ];
  for (const [status, json, text] of answers) {
    await page.route('**/command', (route) => route.fulfill({ status, json }), { times: 1 });
    await page.click('#hold');
    await reads(page, '#reply', text);
  }
  await page.route('**/command', (route) => route.abort(), { times: 1 });
  await page.click('#hold');
  await reads(page, '#reply', /^hold: no answer from the view; the command may have been accepted$/);

  let failHold;
  const isPauseAnswered = new Promise((resolve) => {
    failHold = resolve;
  });
  await page.route('**/command', async (route) => {
    const { command } = route.request().postDataJSON();
    if (command === 'pause') return route.fulfill({ json: { accepted: true, tick: 7 } });
    await isPauseAnswered;
    return route.fulfill({ status: 504, json: { error: 'it may have accepted the command' } });
  });
  await page.click('#hold');
  await page.click('#pause');
  await reads(page, '#reply', /^paused from tick 7$/);
  failHold();
  await reads(page, '#reply', /^hold: no answer: it may have accepted the command · paused from tick 7$/);
}
