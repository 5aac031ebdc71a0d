// What the scenarios of the planner's page read from it, and do with it.

import { expect } from './browser.mjs';

/** Moves of a drag. */
export const DRAGS = 100;

/** The numbers that the page shows, by their names. */
export const numbers = (page) =>
  page.evaluate(() => Object.fromEntries([...document.querySelectorAll('#numbers div')].map(({ children: [name, value] }) => [name.textContent, value.textContent])));

/** Waits until the page is drawn with all that has happened before: what is read from it is then of now. */
export const drawn = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

/** Waits until the planner has answered every question about the text. */
export async function settled(page) {
  await drawn(page);
  await page.waitForFunction(() => {
    const { idle, studied } = document.querySelector('#plan-area').dataset;
    return idle === 'true' && studied === 'true';
  });
}

/** Waits for an answer that is newer than a number. */
export const newer = (page, number) => page.waitForFunction((before) => Number(document.querySelector('#plan-area').dataset.number) > before, number);

export const number = (page) => page.evaluate(() => Number(document.querySelector('#plan-area').dataset.number));

/** Where a place of the plane is on the screen. */
export const screenOf = (page, [x_m, y_m]) =>
  page.evaluate(([x_m, y_m]) => {
    const area = document.querySelector('#plan-area');
    const [x, y, scale] = document.querySelector('#plan').dataset.camera.split(' ').map(Number);
    const { left, top, width, height } = area.getBoundingClientRect();
    return { x: left + width / 2 + (x_m - x) * scale, y: top + height / 2 - (y_m - y) * scale };
  }, [x_m, y_m]);

/** Chooses a point by its name, and returns its place, in metres and on the screen. */
export async function place(page, name) {
  await page.selectOption('#point', { label: name });
  await drawn(page);
  const [, x_m, y_m] = (await page.getAttribute('#plan-area', 'data-chosen')).split(' ').map(Number);
  return { x_m, y_m, ...(await screenOf(page, [x_m, y_m])) };
}

export const text = (page) => page.inputValue('#text');

/** Drags a point in many moves. Returns how long each took until the page had painted its answer, in milliseconds, sorted. */
export async function drag(page, from, to) {
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  const taken_ms = [];
  for (let move = 1; move <= DRAGS; move += 1) {
    const part = move / DRAGS;
    const before = await number(page);
    await page.evaluate(() => {
      const area = document.querySelector('#plan-area');
      window.moved = new Promise((resolve) => {
        area.addEventListener('pointermove', () => {
          const begun_ms = performance.now();
          const old = area.dataset.number;
          new MutationObserver((_, observer) => {
            if (area.dataset.number === old) return;
            observer.disconnect();
            // A message comes after the picture that is under way.
            const { port1, port2 } = new MessageChannel();
            port1.onmessage = () => resolve(performance.now() - begun_ms);
            port2.postMessage(0);
          }).observe(area, { attributes: true, attributeFilter: ['data-number'] });
        }, { once: true });
      });
    });
    await page.mouse.move(from.x + (to.x - from.x) * part, from.y + (to.y - from.y) * part);
    taken_ms.push(await page.evaluate(() => window.moved));
    expect((await number(page)) > before, 'a move has an answer');
  }
  await page.mouse.up();
  return taken_ms.toSorted((one, other) => one - other);
}
