// Plays a show that the planner has computed. Poses are key frames over the head's travel; the timetable gives the travel at a time.
// Between two key frames, each handle is on the cubic of Catmull and Rom through four of them.
'use strict';

const show = JSON.parse(document.getElementById('show').textContent);
const find = (id) => document.getElementById(id);
const canvas = find('plan');
const pen = canvas.getContext('2d');

for (const dragon of show.dragons) {
  const bytes = Uint8Array.from(atob(dragon.frames), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  dragon.places = new Float32Array(bytes.length / 4).map((_, at) => view.getFloat32(4 * at, true));
  dragon.count = dragon.places.length / (2 * dragon.handles);
}

/** Travel of the head at a time. A piece is its beginning in seconds and metres, its speed and its acceleration. */
function travelAt(pieces, time) {
  let at = pieces.length - 1;
  while (at > 0 && pieces[at][0] > time) at--;
  const [fromTime, from, speed, acceleration] = pieces[at];
  const elapsed = Math.max(time - fromTime, 0);
  const travel = from + (speed + 0.5 * acceleration * elapsed) * elapsed;
  return at + 1 < pieces.length ? Math.min(travel, pieces[at + 1][1]) : from;
}

/** The handles of a dragon at a time: x and y of each, in metres. */
function handlesAt(dragon, time) {
  const { places, count, handles } = dragon;
  const last = count - 1;
  const place = Math.min(Math.max((travelAt(dragon.pieces, time) - dragon.first) / dragon.step, 0), last);
  const one = Math.min(Math.floor(place), Math.max(last - 1, 0));
  const part = place - one;
  const frame = (at) => Math.min(Math.max(at, 0), last) * 2 * handles;
  const [before, from, to, after] = [frame(one - 1), frame(one), frame(one + 1), frame(one + 2)];
  const [hasBefore, hasAfter] = [one > 0, one + 2 <= last];
  const found = new Float64Array(2 * handles);
  for (let at = 0; at < 2 * handles; at++) {
    const start = places[from + at];
    const end = places[to + at];
    const rise = end - start;
    let startTangent = 0.5 * (end - places[before + at]);
    let endTangent = 0.5 * (places[after + at] - start);
    // At an end, the curve is the parabola through three key frames.
    if (!hasBefore) startTangent = hasAfter ? 2 * rise - endTangent : rise;
    if (!hasAfter) endTangent = hasBefore ? 2 * rise - startTangent : rise;
    found[at] =
      start +
      part * (startTangent + part * (3 * rise - 2 * startTangent - endTangent + part * (startTangent + endTangent - 2 * rise)));
  }
  return found;
}

// What is shown: the time, whether it runs, and the part of the plan.
let now = show.begin;
let playing = false;
let lastTick = 0;
let camera = null;
let drawn = [];

const everything = (() => {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  const add = ([x, y]) => {
    box[0] = Math.min(box[0], x);
    box[1] = Math.min(box[1], y);
    box[2] = Math.max(box[2], x);
    box[3] = Math.max(box[3], y);
  };
  for (const dragon of show.dragons) {
    for (let at = 0; at < dragon.places.length; at += 2) add([dragon.places[at], dragon.places[at + 1]]);
  }
  for (const line of [show.stage.outline, ...show.stage.keep_out, show.stage.crowd]) line.forEach(add);
  return box;
})();

function fit() {
  const [left, bottom, right, top] = everything;
  const margin = 1;
  const scale = Math.min(
    canvas.width / (right - left + 2 * margin),
    canvas.height / (top - bottom + 2 * margin),
  );
  camera = { x: (left + right) / 2, y: (bottom + top) / 2, scale };
}

/** The pixel of a point in metres. */
const toPixel = (x, y) => [
  canvas.width / 2 + (x - camera.x) * camera.scale,
  canvas.height / 2 - (y - camera.y) * camera.scale,
];

function line(points, closed) {
  pen.beginPath();
  for (const [x, y] of points) pen.lineTo(x, y);
  if (closed) pen.closePath();
}

function board(handles, bench, dragon) {
  const [x, y, toX, toY] = handles.subarray(2 * bench, 2 * bench + 4);
  const link = Math.hypot(x - toX, y - toY) || 1;
  const along = [((x - toX) / link) * dragon.hole, ((y - toY) / link) * dragon.hole];
  const across = [((y - toY) / link) * dragon.width * 0.5, (-(x - toX) / link) * dragon.width * 0.5];
  pen.moveTo(x + along[0] + across[0], y + along[1] + across[1]);
  pen.lineTo(x + along[0] - across[0], y + along[1] - across[1]);
  pen.lineTo(toX - along[0] - across[0], toY - along[1] - across[1]);
  pen.lineTo(toX - along[0] + across[0], toY - along[1] + across[1]);
  pen.closePath();
}

/** Whether the first contact is past. */
const touches = () => show.contact !== null && now >= show.contact.at;

function draw() {
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.clearRect(0, 0, canvas.width, canvas.height);
  const [originX, originY] = toPixel(0, 0);
  pen.setTransform(camera.scale, 0, 0, -camera.scale, originX, originY);
  const pixel = devicePixelRatio / camera.scale;
  pen.lineJoin = 'round';
  pen.lineWidth = 2 * pixel;
  pen.strokeStyle = '#1d1d1b';
  pen.fillStyle = '#e5e0d3';
  for (const area of show.stage.keep_out) {
    line(area, true);
    pen.fill();
    pen.stroke();
  }
  line(show.stage.outline, true);
  pen.stroke();
  pen.setLineDash([8 * pixel, 6 * pixel]);
  pen.strokeStyle = '#7b2d6b';
  line(show.stage.crowd, false);
  pen.stroke();
  pen.setLineDash([]);
  pen.lineWidth = pixel;
  for (const dragon of show.dragons) {
    pen.strokeStyle = show.dragons.length > 1 ? dragon.colour : '#a9a396';
    line(dragon.route, false);
    pen.stroke();
  }
  pen.strokeStyle = '#1d1d1b';
  drawn = show.dragons.map((dragon) => handlesAt(dragon, now));
  show.dragons.forEach((dragon, number) => {
    pen.fillStyle = dragon.colour;
    pen.beginPath();
    for (let bench = dragon.handles - 2; bench > 0; bench--) board(drawn[number], bench, dragon);
    pen.fill();
    if (dragon.width > 3 * pixel) pen.stroke();
    pen.fillStyle = '#1d1d1b';
    pen.beginPath();
    board(drawn[number], 0, dragon);
    pen.fill();
  });
  if (!touches()) return;
  pen.fillStyle = '#d5321e';
  for (const [number, bench] of show.contact.benches) {
    pen.beginPath();
    board(drawn[number], bench, show.dragons[number]);
    pen.fill();
    pen.stroke();
  }
}

const clock = (time) => {
  const sign = time < -0.0005 ? '−' : '';
  const tenths = Math.round(Math.abs(time) * 10);
  const seconds = (tenths % 600) / 10;
  return `${sign}${Math.floor(tenths / 600)}:${seconds < 10 ? '0' : ''}${seconds.toFixed(1)}`;
};

const cues = show.cues.map((cue) => {
  const item = document.createElement('li');
  const button = document.createElement('button');
  button.type = 'button';
  button.className = 'cue';
  const words = [cue.waits ? 'waits for GO' : '', cue.note].filter(Boolean).join(' · ');
  button.textContent = `${clock(cue.at)}  ${cue.name}`;
  if (words) button.append(Object.assign(document.createElement('small'), { textContent: words }));
  button.addEventListener('click', () => seek(cue.at));
  item.append(button);
  find('cues').append(item);
  return { ...cue, button };
});
find('cues-part').hidden = cues.length === 0;
for (const dragon of show.dragons) {
  const item = document.createElement('li');
  const swatch = document.createElement('span');
  swatch.className = 'swatch';
  swatch.style.background = dragon.colour;
  item.append(swatch, `${dragon.name}: ${dragon.handles - 1} ${dragon.handles === 2 ? 'bench' : 'benches'}`);
  find('dragons').append(item);
}

function update() {
  draw();
  find('seek').value = now;
  find('seek').setAttribute('aria-valuetext', clock(now));
  find('time').textContent = `${clock(now)} of ${clock(show.end)}`;
  for (const cue of cues) cue.button.classList.toggle('reached', cue.at <= now + 1e-9);
  find('contact').hidden = !touches();
}

function seek(time) {
  now = Math.min(Math.max(time, show.begin), show.end);
  update();
}

function setPlaying(plays) {
  playing = plays;
  find('play').textContent = plays ? 'Pause' : 'Play';
  if (!plays) return;
  if (now >= show.end) seek(show.begin);
  lastTick = performance.now();
  requestAnimationFrame(tick);
}

function tick(at) {
  if (!playing) return;
  // A window that was hidden does not catch up.
  const elapsed = Math.min(Math.max(at - lastTick, 0), 250) / 1000;
  lastTick = at;
  seek(now + elapsed * Number(find('speed').value));
  if (now >= show.end) setPlaying(false);
  else requestAnimationFrame(tick);
}

function resize() {
  const isNew = camera === null;
  canvas.width = Math.max(1, Math.round(canvas.clientWidth * devicePixelRatio));
  canvas.height = Math.max(1, Math.round(canvas.clientHeight * devicePixelRatio));
  if (isNew || camera.fitted) {
    fit();
    camera.fitted = true;
  }
  update();
}

/** Zooms by a factor about a pixel of the canvas. */
function zoom(factor, [x, y]) {
  const scale = Math.min(Math.max(camera.scale * factor, 0.01), 1e5);
  const shift = 1 / camera.scale - 1 / scale;
  camera = {
    x: camera.x + (x - canvas.width / 2) * shift,
    y: camera.y - (y - canvas.height / 2) * shift,
    scale,
    fitted: false,
  };
  update();
}

const middle = () => [canvas.width / 2, canvas.height / 2];
canvas.addEventListener(
  'wheel',
  (event) => {
    event.preventDefault();
    zoom(Math.exp(-0.0015 * event.deltaY), [event.offsetX * devicePixelRatio, event.offsetY * devicePixelRatio]);
  },
  { passive: false },
);
canvas.addEventListener('pointerdown', (event) => canvas.setPointerCapture(event.pointerId));
canvas.addEventListener('pointermove', (event) => {
  if (!canvas.hasPointerCapture(event.pointerId)) return;
  camera.x -= (event.movementX * devicePixelRatio) / camera.scale;
  camera.y += (event.movementY * devicePixelRatio) / camera.scale;
  camera.fitted = false;
  update();
});
find('play').addEventListener('click', () => setPlaying(!playing));
find('seek').addEventListener('input', (event) => seek(Number(event.target.value)));
find('fit').addEventListener('click', () => {
  fit();
  camera.fitted = true;
  update();
});
find('nearer').addEventListener('click', () => zoom(1.4, middle()));
find('further').addEventListener('click', () => zoom(1 / 1.4, middle()));
document.addEventListener('keydown', (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || /^(BUTTON|SELECT)$/.test(event.target.tagName)) return;
  const second = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  if (event.key === ' ') setPlaying(!playing);
  else if (second !== undefined) seek(now + second);
  else return;
  event.preventDefault();
});

find('seek').min = show.begin;
find('seek').max = show.end;
new ResizeObserver(resize).observe(canvas);
resize();

/** For programs that embed or test the page: the handles that were drawn last, and the pixel of a point. */
window.player = { seek, setPlaying, now: () => now, drawn: () => drawn.map((handles) => [...handles]), toPixel };
