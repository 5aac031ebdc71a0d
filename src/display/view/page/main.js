// @ts-check
// The page of `bench-dragon view`. It stores the view's messages in a Show and draws it: the plan at the screen's rate, only
// after changes; the numbers and the timeline ten times a second.

import { endOf, eventsAhead, leftInWords, nextInWords, restOf } from './ahead.js';
import { alertKey, listAlerts } from './alerts.js';
import { Announcer } from './announcer.js';
import { benchAt } from './boards.js';
import { Camera } from './camera.js';
import { Connection } from './connection.js';
import { listCommands } from './commands.js';
import { hasContact, noticeContact } from './contact_notice.js';
import { Controls } from './controls.js';
import { cueInWords, nextCue } from './cue_words.js';
import { listCues } from './cues.js';
import { Details } from './details.js';
import { element, write } from './element.js';
import { writeFigures } from './figures.js';
import * as format from './format.js';
import { listenToKeys } from './keys.js';
import { lightLamps } from './lamps.js';
import { Pace } from './pace.js';
import { PictureAge } from './picture_age.js';
import { readPalette } from './palette.js';
import { Plan } from './plan.js';
import { listenToPointers } from './pointer.js';
import { ReplayBar } from './replay_bar.js';
import { Show } from './show.js';
import { obstacle, operatorsStops, standing } from './standing.js';
import { isWall, writeStrip } from './strip.js';
import { offerTabs } from './tabs.js';
import { offerThemes } from './theme.js';
import { Timeline } from './timeline.js';
import { listenToAddress, takeToken } from './token.js';
import { listenToField } from './token_notice.js';
import { WallClock } from './wall_clock.js';

const NUMBERS_PERIOD_MS = 100;
const TEXT_PERIOD_MS = 2000;
const ZOOM_STEP = 1.35;
const PAN_STEP_PX = 60;
const MOST_HEARD = 1000;
/** Distance in pixels up to which a pointer selects a bench. */
const REACH_PX = { mouse: 4, touch: 20 };

const show = new Show();
const camera = new Camera();
const pace = new Pace();
const announcer = new Announcer();
const pictureAge = new PictureAge();
const wallClock = new WallClock();
const area = element('plan-area', HTMLElement);
const canvas = element('plan', HTMLCanvasElement);
/** Keys of the handled alerts, including those of an earlier view. @type {Set<string>} */
const heard = new Set();
let instance = '';
let isPlanDue = false;
let isRenewalDue = false;

const palette = readPalette();
const plan = new Plan(canvas, camera, palette, drawSoon);
const details = new Details(drawSoon);
const token = takeToken();
const controls = new Controls(token);
const replayBar = new ReplayBar(token);
const timeline = new Timeline(palette, (time_s) => controls.proposeSeek(time_s), renewSoon);

const connection = new Connection(token, {
  access(access) {
    instance = access.instance;
    write(element('instance', HTMLElement), instance);
    controls.allow(access);
    replayBar.allow(access);
  },
  frame(frame) {
    pictureAge.sent(frame.sequence, performance.now());
    show.takeFrame(frame);
    drawSoon();
  },
  message,
  line() {
    if (connection.line.state === 'open') {
      show.forgetEvents();
      pictureAge.restart();
    }
    renew();
  },
});

/** @param {{type: string}} news */
function message(news) {
  const value = /** @type {any} */ (news);
  if (news.type === 'run') {
    show.takeRun(value);
    controls.takeRun(value);
  } else if (news.type === 'plan') {
    show.takePlan(value);
  } else if (news.type === 'status') {
    show.takeStatus(value);
    pictureAge.heard(value.heard, performance.now());
    wallClock.set(value.day_ms, performance.now());
  } else if (news.type === 'command') {
    show.takeCommand(value);
  } else if (news.type === 'alert' && show.takeAlert(value) && !heard.has(alertKey(value))) {
    if (heard.size >= MOST_HEARD) heard.clear();
    heard.add(alertKey(value));
    announcer.alert(value);
    if (value.kind === 'contact') noticeContact(value);
  }
}

/** @param {string} token */
function useToken(token) {
  controls.useToken(token);
  replayBar.useToken(token);
  connection.useToken(token);
}

/** Schedules a drawing of the plan for the screen's next picture. */
function drawSoon() {
  if (isPlanDue) return;
  isPlanDue = true;
  requestAnimationFrame((now_ms) => {
    isPlanDue = false;
    plan.draw(show, details.bench());
    pace.count(now_ms);
    if (show.frame !== null) {
      canvas.dataset.tick = String(show.frame.tick);
      canvas.dataset.benches = String(show.frame.benches);
      canvas.dataset.dragons = String(show.frame.dragons.length);
    }
  });
}

/** Schedules a writing of everything but the plan for the screen's next picture. */
function renewSoon() {
  if (isRenewalDue) return;
  isRenewalDue = true;
  requestAnimationFrame(renew);
}

/** Writes everything but the plan. */
function renew() {
  isRenewalDue = false;
  const now_ms = performance.now();
  timeline.draw(show);
  const { frame } = show;
  const age_s = frame === null ? null : pictureAge.of(frame.due_ms, now_ms);
  const stands = standing(connection.line, show, now_ms, age_s);
  writeStrip(stands, signs(stands, now_ms), instance, show);
  announcer.standing(stands);
  writeFigures(show);
  write(element('next', HTMLElement), next());
  write(element('picture-age', HTMLElement), age_s === null ? '–' : format.shortTime(age_s * 1e6));
  if (plan.read(show)) drawSoon();
  const { status } = show;
  const lacks = obstacle(connection.line, show);
  controls.takeSituation(status?.refusals ?? null, operatorsStops(show), lacks);
  controls.offerGo((status?.cues ?? null) !== null);
  listCues(status?.cues ?? null, (at_s) => controls.proposeCue(at_s));
  replayBar.write(status, show.status_ms, now_ms, lacks);
  lightLamps(status?.lamps ?? [], connection.line.state === 'open');
  const unwatched = unwatchedReason();
  listAlerts(show.alerts, show.frame?.run_id, unwatched);
  if (unwatched !== null) noticeOverlap();
  listCommands(show.commands);
  details.write(show);
  const perSecond = pace.perSecond(now_ms);
  write(element('pace', HTMLElement), String(perSecond));
  canvas.dataset.fps = String(perSecond);
}

/** The signs of strip and wall beside the state. @param {import('./standing.js').Standing} stands @param {number} now_ms @returns {import('./strip.js').Signs} */
function signs(stands, now_ms) {
  return {
    contact: contact(),
    clock: wallClock.text(now_ms),
    left: stands.isLive ? leftInWords(restOf(show, endOf(show.runOfFrame(), timeline.times)), show) : '',
    next: next(),
    clearance: format.millimetres(show.frame?.nearest?.clearance_m),
  };
}

/** The next event in words. A cue that waits comes before all others. */
function next() {
  const cue = nextCue(show.status?.cues);
  if (cue?.state === 'waiting') return `GO for ${cueInWords(cue)}`;
  const [event] = eventsAhead(show, timeline.times, endOf(show.runOfFrame(), timeline.times));
  return nextInWords(event, show);
}

/** An overlap now, or a contact that nobody has acknowledged. */
function contact() {
  const nearest = show.frame?.nearest ?? null;
  if (nearest !== null && nearest.clearance_m <= 0) return 'OVERLAP';
  return hasContact() ? 'CONTACT' : '';
}

/** The reason for which no monitor searches for contacts; `null` if one does. */
function unwatchedReason() {
  const monitor = show.status?.lamps.find(({ name }) => name === 'monitor');
  if (monitor === undefined || monitor.level === 'good' || monitor.level === 'off') return null;
  return `Contacts may go unreported. Monitor: ${monitor.text}.`;
}

/** Without a monitor, reports an overlap that the view has measured. */
function noticeOverlap() {
  const least = show.status?.least ?? null;
  if (show.frame === null || least === null || least.clearance_m > 0) return;
  noticeContact({ run_id: show.frame.run_id, benches: null, ...least });
}

/** Writes the plan in words, for screen readers. */
function describe() {
  const { frame } = show;
  if (frame === null) return;
  const names = show.runOfFrame()?.dragons;
  const count = names === undefined ? '' : `${frame.dragons.length} dragons of `;
  const sentences = [`${count}${frame.benches} benches, ${frame.state}, at ${format.showTime(frame.time_s)} seconds.`];
  frame.dragons.forEach(({ first_handle }, number) => {
    const [x, y] = frame.handles.subarray(first_handle * 3);
    const head = names === undefined ? 'The head' : `The head of ${names[number]?.name}`;
    sentences.push(`${head} is at ${format.fixed(x, 2)}, ${format.fixed(y, 2)} metres.`);
  });
  const nearest = show.nearestPair();
  if (nearest !== null) {
    sentences.push(`Nearest are ${format.pair(nearest)}, ${format.millimetres(nearest.clearance_m)} millimetres apart.`);
  }
  write(element('plan-text', HTMLElement), sentences.join(' '));
}

/** @param {import('./pointer.js').Place} place @param {number} reach_px */
function benchUnder({ x, y }, reach_px) {
  if (show.frame === null) return null;
  return benchAt(show.frame, show.runOfFrame(), camera.toPlane(x, y), reach_px / camera.scale);
}

/** @param {() => void} move */
function look(move) {
  return () => {
    move();
    element('follow', HTMLButtonElement).setAttribute('aria-pressed', String(camera.mode === 'follow'));
    drawSoon();
  };
}

const fit = look(() => {
  camera.mode = 'fit';
});
const follow = look(() => (camera.mode === 'follow' ? (camera.mode = 'free') : camera.follow()));
const zoomIn = look(() => camera.zoom(ZOOM_STEP));
const zoomOut = look(() => camera.zoom(1 / ZOOM_STEP));
const pan = (/** @type {number} */ dx, /** @type {number} */ dy) =>
  look(() => camera.pan(dx * PAN_STEP_PX, dy * PAN_STEP_PX));

for (const [id, action] of Object.entries({ fit, follow, 'zoom-in': zoomIn, 'zoom-out': zoomOut })) {
  element(id, HTMLButtonElement).addEventListener('click', action);
}
listenToPointers(area, {
  pan: (dx, dy) => look(() => camera.pan(dx, dy))(),
  zoom: (factor, x, y) => look(() => camera.zoom(factor, x, y))(),
  tap(place, isTouch) {
    details.choose(benchUnder(place, isTouch ? REACH_PX.touch : REACH_PX.mouse));
    drawSoon();
    renew();
  },
  hover(place) {
    if (details.point(place === null ? null : benchUnder(place, REACH_PX.mouse))) {
      drawSoon();
      details.write(show);
    }
  },
});
const keys = {
  ' ': () => controls.pauseOrResume(),
  'Shift+R': () => controls.release(),
  G: () => controls.go(),
  F: follow,
  0: fit,
  '+': zoomIn,
  '=': zoomIn,
  '-': zoomOut,
  ArrowLeft: pan(1, 0),
  ArrowRight: pan(-1, 0),
  ArrowUp: pan(0, 1),
  ArrowDown: pan(0, -1),
  B: () => details.focus(),
  T: () => timeline.focus(),
};
// A wall has no controls that somebody could see. H always holds.
listenToKeys(() => controls.hold(), isWall ? {} : keys);
offerTabs(['cues', 'alerts', 'commands', 'health']);
offerThemes(() => {
  const colours = readPalette();
  plan.recolour(colours);
  timeline.recolour(colours);
  drawSoon();
  timeline.draw(show);
});
listenToField(useToken);
listenToAddress(useToken);

setInterval(renew, NUMBERS_PERIOD_MS);
setInterval(describe, TEXT_PERIOD_MS);
renew();
void connection.open();
