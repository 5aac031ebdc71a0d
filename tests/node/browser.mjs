// A page of the view in Chromium, for the scenarios beside this file. Each scenario is started with the page's address. It
// writes its progress to stdout as lines of JSON, and exits with status 0 if all checks pass. When the test reads a line, it
// does its own part, for example killing a server. No scenario waits for a fixed time.

import { once } from 'node:events';
import { createRequire } from 'node:module';
import path from 'node:path';

const packages = process.env.BENCH_DRAGON_NODE ?? path.resolve(import.meta.dirname, '../../target/node');
const installed = createRequire(path.join(packages, 'package.json'));
export const { chromium } = installed('playwright-core');
export const axeSource = installed('axe-core').source;

const TIMEOUT_MS = 150_000;
/** Time after which an action without an outcome is repeated. It is longer than a question of the page is valid. */
const RETRY_MS = 10_000;
const MOST_TRIES = 12;
const FLAGS = [
  '--no-sandbox',
  '--disable-gpu',
  '--disable-quic',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
];

/** Runs a scenario with Chromium, and closes Chromium afterwards. */
export async function withBrowser(scenario) {
  const browser = await chromium.launch({
    executablePath: process.env.BENCH_DRAGON_CHROMIUM ?? '/usr/bin/chromium',
    args: FLAGS,
    timeout: TIMEOUT_MS,
  });
  try {
    await scenario(browser);
  } finally {
    await browser.close();
  }
}

/** Opens a page at an address, and collects its errors and warnings. `init` runs in the page before its own scripts. */
export async function openPage(browser, address, { init, ...options } = {}) {
  const context = await browser.newContext({
    viewport: { width: 1280, height: 800 },
    colorScheme: 'light',
    ...options,
  });
  context.setDefaultTimeout(TIMEOUT_MS);
  if (init !== undefined) await context.addInitScript(init);
  const page = await context.newPage();
  const complaints = [];
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type())) complaints.push(message.text());
  });
  page.on('pageerror', (error) => complaints.push(error.stack));
  await page.goto(address);
  return { page, complaints };
}

/** Waits until the page has a status, named as in the style sheet. */
export async function stands(page, status) {
  const wait = page.waitForFunction((wanted) => document.body.dataset.status === wanted, status);
  await named(page, `the page has the status ${status}`, wait);
}

/**
 * Repeats an action until the page has a status. A page that was busy for over 1.5 s takes its connection for lost, and ignores
 * keys until it has connected again.
 */
export async function reach(page, status, act) {
  for (let tries = 0; tries < MOST_TRIES; tries += 1) {
    await act();
    if (await holdsSoon(page, (wanted) => document.body.dataset.status === wanted, status)) return;
  }
  await stands(page, status);
}

/** Presses a button until its question is seen: after 5 s, the page takes the question back. */
export async function asks(page, button, word, question) {
  for (let tries = 0; tries < MOST_TRIES; tries += 1) {
    await page.click(button);
    if (await holdsSoon(page, matches, [[word, question.source]])) return;
  }
  await reads(page, word, question);
}

/** Presses a button that asks for confirmation until the reply matches. */
export async function confirm(page, button, word, question, reply) {
  await asks(page, button, word, question);
  for (let tries = 0; tries < MOST_TRIES; tries += 1) {
    await page.click(button);
    // The reply, or the question again if it had lapsed before the press.
    await holdsSoon(page, matches, [
      ['#reply', reply.source],
      [word, question.source],
    ]);
    const text = await page.textContent('#reply');
    if (reply.test(text)) return;
    if (text.endsWith('…')) break;
  }
  await reads(page, '#reply', reply);
}

/** Whether the text of one of these elements matches its pattern. Runs in the page. */
function matches(wanted) {
  return wanted.some(([where, source]) => new RegExp(source).test(document.querySelector(where)?.textContent ?? ''));
}

/** Whether a condition holds within the time after which an action is repeated. */
async function holdsSoon(page, condition, argument) {
  try {
    await page.waitForFunction(condition, argument, { timeout: RETRY_MS });
    return true;
  } catch (error) {
    if (error.name !== 'TimeoutError') throw error;
    return false;
  }
}

/** Waits until an element's text matches. */
export async function reads(page, selector, pattern) {
  const isRead = ([where, source]) => new RegExp(source).test(document.querySelector(where)?.textContent ?? '');
  await named(page, `${selector} reads ${pattern}`, page.waitForFunction(isRead, [selector, pattern.source]));
  return page.textContent(selector);
}

/** The page's values of the frame that the plan was last drawn from, once numbers and plan are from the same frame. */
export async function shown(page) {
  const both = await page.waitForFunction(() => {
    const plan = document.querySelector('#plan').dataset;
    const numbers = document.querySelector('#clearance-figure').dataset;
    return plan.tick === numbers.tick && { ...numbers, ...plan };
  });
  const { tick, benches, clearanceM, nearest, camera } = await both.jsonValue();
  return {
    tick: Number(tick),
    benches: Number(benches),
    clearance_m: Number(clearanceM),
    nearest: nearest.split(' ').map(Number),
    camera: camera.split(' ').map(Number),
    read: await page.textContent('#clearance'),
  };
}

/** Awaits `wait`. Its failure reports the awaited event and the page's text. */
async function named(page, what, wait) {
  try {
    return await wait;
  } catch (error) {
    const shows = await page.innerText('body').catch(() => 'nothing');
    throw new Error(`waited until ${what}; the page shows:\n${shows}`, { cause: error });
  }
}

/** Waits for an event of a process or a stream. */
export async function occurs(emitter, event, what) {
  try {
    return await once(emitter, event, { signal: AbortSignal.timeout(TIMEOUT_MS) });
  } catch (error) {
    throw new Error(`waited ${TIMEOUT_MS / 1000} s until ${what}`, { cause: error });
  }
}

export function say(value) {
  process.stdout.write(`${JSON.stringify(value)}\n`);
}

/** Ends the scenario with an error unless a condition holds. */
export function expect(holds, what) {
  if (!holds) throw new Error(what);
}
