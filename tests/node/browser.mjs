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

const TIMEOUT_MS = 60_000;
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
