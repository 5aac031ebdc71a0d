// @ts-check
// The style sheet's colours for canvases, which cannot use its variables.

const NAMES = /** @type {const} */ ([
  'ink',
  'quiet',
  'rule',
  'edge',
  'accent',
  'route',
  'wood',
  'wood-edge',
  'head',
  'head-edge',
  'pair',
  'near',
  'near-fill',
  'contact',
  'contact-fill',
  'halo',
  'panel',
]);

/** @typedef {Record<typeof NAMES[number], string>} Palette */

/** @returns {Palette} */
export function readPalette() {
  const probe = document.createElement('span');
  document.body.append(probe);
  const colours = NAMES.map((name) => {
    probe.style.color = `var(--${name})`;
    return [name, getComputedStyle(probe).color];
  });
  probe.remove();
  return Object.fromEntries(colours);
}
