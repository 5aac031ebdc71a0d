// Converts a terminal's screen, as `tmux capture-pane -e` prints it, to a page.
'use strict';

const COLOURS = [
  '#1c2227',
  '#ff6b5f',
  '#5fd3a0',
  '#f2b544',
  '#6ba8f5',
  '#c48be0',
  '#4fd1c5',
  '#d6dde2',
  '#7d8a94',
  '#ff8f85',
  '#86e5bb',
  '#ffcf70',
  '#93c2ff',
  '#dcaef2',
  '#83e6dc',
  '#ffffff',
];
const [INK, GROUND] = ['#d6dde2', '#0d1216'];

const ENTITIES = { '&': '&amp;', '<': '&lt;' };
const isBraille = (character) => character >= '\u2800' && character <= '\u28ff';
/** Column and row of each dot of a braille character, lowest bit first. */
const DOTS = [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2], [0, 3], [1, 3]];

/** The page's HTML. */
exports.terminalPage = (screen) => {
  const rows = screen.replace(/\n$/, '').split('\n').map(row);
  return `<!DOCTYPE html><meta charset="utf-8"><style>
    body { margin: 0; background: transparent; }
    div { display: inline-block; padding: 16px 20px; border-radius: 12px; background: ${GROUND}; color: ${INK}; font: 15.5px/20px "DejaVu Sans Mono", monospace; }
    p { margin: 0; height: 20px; white-space: pre; }
    i { display: inline-block; width: 9.3333px; height: 20px; font-style: normal; vertical-align: top; }
    svg { display: block; fill: currentColor; }
  </style><div>${rows.join('')}</div>`;
};

function row(text) {
  let [style, html] = [plain(), ''];
  for (const [, codes, character] of text.matchAll(/\x1b\[([\d;]*)m|([^\x1b])/gu)) {
    if (character === undefined) style = turned(style, codes.split(';').map(Number));
    else html += cell(character, style);
  }
  return `<p>${html}</p>`;
}

const plain = () => ({ ink: INK, ground: null, isBold: false, isFaint: false, isReversed: false });

/** Returns the style after an SGR sequence. */
function turned(before, codes) {
  let style = { ...before };
  for (let at = 0; at < codes.length; at += 1) {
    const code = codes[at];
    if (code === 0) style = plain();
    else if (code === 1) style.isBold = true;
    else if (code === 2) style.isFaint = true;
    else if (code === 7) style.isReversed = true;
    else if (code === 22) Object.assign(style, { isBold: false, isFaint: false });
    else if (code === 27) style.isReversed = false;
    else if (code === 39) style.ink = INK;
    else if (code === 49) style.ground = null;
    else if (code === 38 || code === 48) {
      const [colour, taken] = extended(codes.slice(at + 1));
      style[code === 38 ? 'ink' : 'ground'] = colour;
      at += taken;
    } else if (code >= 30 && code < 38) style.ink = COLOURS[code - 30];
    else if (code >= 40 && code < 48) style.ground = COLOURS[code - 40];
    else if (code >= 90 && code < 98) style.ink = COLOURS[code - 82];
    else if (code >= 100 && code < 108) style.ground = COLOURS[code - 92];
  }
  return style;
}

/** Returns a colour of the 256-colour palette or of 24 bits, and the number of codes that it used. */
function extended([kind, ...values]) {
  if (kind === 2) return [`rgb(${values.slice(0, 3).join()})`, 4];
  const index = values[0];
  if (index < 16) return [COLOURS[index], 2];
  if (index >= 232) {
    const grey = 8 + 10 * (index - 232);
    return [`rgb(${grey},${grey},${grey})`, 2];
  }
  const level = (step) => (step === 0 ? 0 : 55 + 40 * step);
  const cube = index - 16;
  return [`rgb(${[Math.floor(cube / 36), Math.floor(cube / 6) % 6, cube % 6].map(level).join()})`, 2];
}

function cell(character, { ink, ground, isBold, isFaint, isReversed }) {
  const [front, back] = isReversed ? [ground ?? GROUND, ink] : [ink, ground];
  const look = [
    `color:${front}`,
    // Overlaps the next cell slightly, so that equal neighbours show no seam.
    back === null ? '' : `background:${back};box-shadow:1px 0 ${back}`,
    isBold ? 'font-weight:700' : '',
    isFaint ? 'opacity:.65' : '',
  ];
  const drawn = isBraille(character) ? dots(character) : character.replace(/[&<]/g, (one) => ENTITIES[one]);
  return `<i style="${look.filter(Boolean).join(';')}">${drawn}</i>`;
}

/** Draws braille over the whole cell, as some terminals do, so that dots of neighbouring cells have equal distances. */
function dots(character) {
  const bits = character.codePointAt(0) - 0x2800;
  const seen = DOTS.filter((_, bit) => (bits >> bit) & 1);
  const circles = seen.map(([column, row]) => `<circle cx="${2.33 + 4.67 * column}" cy="${2.5 + 5 * row}" r="1.5"/>`);
  return `<svg width="9.3333" height="20">${circles.join('')}</svg>`;
}
