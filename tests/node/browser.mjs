// A page of the view in Chromium, for the scenarios beside this file. Each of them is started with the page's address, says
// on stdout in JSON what it has come to, a line each, and ends with 0 if all went well. What the test has to do meanwhile
// (kill a server, say) it does when it reads the line; nobody waits for a time.

import { once } from 'node:events';
import { createRequire } from 'node:module';
import path from 'node:path';

const packages = process.env.BENCH_DRAGON_NODE ?? path.resolve(import.meta.dirname, '../../target/node');
const installed = createRequire(path.join(packages, 'package.json'));
export const { chromium } = installed('playwright-core');
export const axeSource = installed('axe-core').source;

const PATIENCE_MS = 60_000;
const FLAGS = [
  '--no-sandbox',
  '--disable-gpu',
  '--disable-quic',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
];

/** Chromium, until the scenario is over. */
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

/** A page at an address, and what it has complained about; before anything else of it, `init` is run in it. */
export async function openPage(browser, address, { init, ...options } = {}) {
  const context = await browser.newContext({
    viewport: { width: 1280, height: 800 },
    colorScheme: 'light',
    ...options,
  });
  context.setDefaultTimeout(PATIENCE_MS);
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

/** Waits until the page says how things stand, in the style sheet's word. */
export async function stands(page, status) {
  const wait = page.waitForFunction((wanted) => document.body.dataset.status === wanted, status);
  await named(page, `the page says ${status}`, wait);
}

/** Waits until an element's text matches. */
export async function reads(page, selector, pattern) {
  const isRead = ([where, source]) => new RegExp(source).test(document.querySelector(where)?.textContent ?? '');
  await named(page, `${selector} reads ${pattern}`, page.waitForFunction(isRead, [selector, pattern.source]));
  return page.textContent(selector);
}

/** What the page shows of the frame that the plan was drawn of last, once numbers and plan are of the same one. */
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

/** A wait whose failure says what was waited for, and what the page shows. */
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
    return await once(emitter, event, { signal: AbortSignal.timeout(PATIENCE_MS) });
  } catch (error) {
    throw new Error(`waited ${PATIENCE_MS / 1000} s until ${what}`, { cause: error });
  }
}

export function say(value) {
  process.stdout.write(`${JSON.stringify(value)}\n`);
}

/** Ends the scenario as failed unless something holds. */
export function expect(holds, what) {
  if (!holds) throw new Error(what);
}
