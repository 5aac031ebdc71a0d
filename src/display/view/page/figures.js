// @ts-check
// The numbers beside the plan.

import { expectedEnd } from './ahead.js';
import { element, write } from './element.js';
import * as format from './format.js';
import { outlookInWords } from './outlook_words.js';

/** @typedef {import('./show.js').Show} Show */
/** @typedef {import('./show.js').Status} Status */

const html = (/** @type {string} */ id) => element(id, HTMLElement);
const clearanceFigure = html('clearance-figure');
const outlookFigure = html('outlook-figure');

/** @param {Show} show */
export function writeFigures(show) {
  writeClearance(show);
  writeOutlook(show);
  writeClock(show);
  if (show.status !== null) writeHealth(show.status);
}

/** @param {Show} show */
function writeClearance(show) {
  const { frame, status } = show;
  const run = show.runOfFrame();
  const nearest = show.nearestPair();
  write(html('clearance'), format.millimetres(nearest?.clearance_m));
  write(html('pair'), nearest === null ? 'no pair yet' : format.pair(nearest));
  const least = lowest(status?.least ?? null, nearest, frame?.time_s ?? 0);
  write(
    html('least'),
    least === null ? '' : `least ${format.millimetres(least.clearance_m)} mm at ${format.fixed(least.time_s, 1)} s`,
  );
  clearanceFigure.dataset.level = level(nearest?.clearance_m, run?.near_m);
  clearanceFigure.dataset.clearanceM = String(nearest?.clearance_m ?? '');
  clearanceFigure.dataset.nearest = nearest === null ? '' : nearest.benches.join(' ');
  clearanceFigure.dataset.tick = String(frame?.tick ?? '');
}

/**
 * The least clearance so far. The view reports it five times a second, so the frame's clearance may be newer.
 * @param {Status['least']} reported
 * @param {import('./frame.js').Nearest | null} nearest
 * @param {number} time_s
 */
function lowest(reported, nearest, time_s) {
  if (reported === null || nearest === null || reported.clearance_m <= nearest.clearance_m) return reported;
  return { clearance_m: nearest.clearance_m, time_s };
}

/** @param {Show} show */
function writeOutlook({ frame, status }) {
  const outlook = status?.outlook ?? /** @type {const} */ ({ kind: 'unknown' });
  const { large, small, level } = outlookInWords(outlook, frame?.state ?? null, status?.possible_contact ?? null, frame?.isFormation);
  outlookFigure.dataset.kind = outlook.kind;
  outlookFigure.dataset.level = level;
  write(html('outlook'), large);
  write(html('outlook-more'), small);
}

/** @param {Show} show */
function writeClock(show) {
  const { frame } = show;
  const run = show.runOfFrame();
  const time = format.showTime(frame?.time_s);
  write(html('show-time'), time);
  const isEndless = run === null || run.end_s - run.start_s > 1e6;
  const end_s = isEndless ? null : expectedEnd(show, run.end_s);
  const of = end_s === null ? '' : ` of ${format.minutes(end_s)}`;
  write(html('time-more'), frame === null ? '' : `${format.minutes(frame.time_s)}${of} min`);
  write(html('speed'), format.fixed(frame?.speed_mps, 2));
  const height = frame?.heights ? `, at height ${format.fixed(frame.heights[0], 2)} m` : '';
  const lead = run?.dragons === undefined ? '' : `${run.dragons[0].name} `;
  write(html('speed-more'), frame === null ? '' : `${lead}walked ${format.fixed(frame.travel_m, 2)} m${height}`);
}

/** @param {Status} status */
function writeHealth({ traffic, server }) {
  write(html('rate'), `${format.fixed(traffic.rate_hz, 0)} /s`);
  write(html('lost'), format.count(traffic.lost));
  html('lost').dataset.bad = String(traffic.lost > 0);
  write(html('latency'), percentiles(traffic.latency_us));
  write(html('overruns'), format.count(server?.overruns));
  html('overruns').dataset.bad = String((server?.overruns ?? 0) > 0);
  write(html('behind'), server === null ? '–' : format.shortTime(server.behind_s * 1e6));
  html('behind').dataset.bad = String((server?.behind_s ?? 0) > 0);
  write(html('lateness'), percentiles(server?.lateness_us));
  write(html('tick'), percentiles(server?.tick_us));
}

/** @param {import('./show.js').Percentiles | null | undefined} times */
function percentiles(times) {
  return times === null || times === undefined
    ? '–'
    : `${format.shortTime(times.p50)} · ${format.shortTime(times.p99)}`;
}

/** @param {number | undefined} clearance_m @param {number | undefined} near_m */
function level(clearance_m, near_m) {
  if (clearance_m === undefined) return 'unknown';
  if (clearance_m <= 0) return 'contact';
  return near_m !== undefined && clearance_m <= near_m ? 'near' : 'free';
}
