// Tests of the page's colours: amber and red differ for people without red or green receptors. The simulation is that of
// Machado, Oliveira and Fernandes, 2009 (severity 1), on linear light; the difference is that of CIE L*.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import { test } from 'node:test';

const css = fs.readFileSync(new URL('../../../src/display/view/page/style.css', import.meta.url), 'utf8');
const DEFICIENCIES = {
  deuteranopia: [
    [0.367322, 0.860646, -0.227968],
    [0.280085, 0.672501, 0.047413],
    [-0.01182, 0.04294, 0.968881],
  ],
  protanopia: [
    [0.152286, 1.052583, -0.204868],
    [0.114503, 0.786281, 0.099216],
    [-0.003882, -0.048116, 1.051998],
  ],
};
/** Least difference of lightness at which two areas are told apart at a glance. */
const LEAST_DIFFERENCE = 20;

/** A colour of the style sheet in a theme. */
function colour(name, theme) {
  const [, value] = new RegExp(`--${name}: ([^;]+);`).exec(css) ?? [];
  const [, light, dark] = /light-dark\((#\w+), (#\w+)\)/.exec(value ?? '') ?? [null, value, value];
  const hex = theme === 'light' ? light : dark;
  assert.match(hex ?? '', /^#[0-9a-f]{6}$/, `${name} in the ${theme} theme`);
  return [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
}

const linear = (part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);

/** Lightness from 0 to 100 of a colour as seen with a deficiency. */
function lightness(rgb, matrix) {
  const seen = matrix.map((row) => Math.min(Math.max(row.reduce((sum, part, at) => sum + part * linear(rgb[at]), 0), 0), 1));
  const y = 0.2126 * seen[0] + 0.7152 * seen[1] + 0.0722 * seen[2];
  return y > 0.008856 ? 116 * Math.cbrt(y) - 16 : 903.3 * y;
}

test('amber is much lighter than red for people without red or green receptors', () => {
  for (const [name, matrix] of Object.entries(DEFICIENCIES)) {
    for (const theme of ['light', 'dark']) {
      for (const [amber, red] of [
        ['amber', 'red'],
        ['near-fill', 'contact-fill'],
        ['near', 'contact-fill'],
      ].slice(0, theme === 'light' ? 2 : 3)) {
        const difference = lightness(colour(amber, theme), matrix) - lightness(colour(red, theme), matrix);
        assert.ok(difference >= LEAST_DIFFERENCE, `${name}, ${theme}: --${amber} and --${red} differ by ${difference.toFixed(1)}`);
      }
    }
  }
});

test('red and the green of a running show differ for them too', () => {
  // The word and the shape are on the strip in any case.
  for (const [name, matrix] of Object.entries(DEFICIENCIES)) {
    const seen = ['running', 'red'].map((one) => matrix.map((row) => row.reduce((sum, part, at) => sum + part * linear(colour(one, 'light')[at]), 0)));
    const apart = Math.hypot(...seen[0].map((part, at) => part - seen[1][at]));
    assert.ok(apart > 0.08, `${name}: ${apart.toFixed(3)}`);
  }
});
