// @ts-check
// The page's data about the show: the newest of each kind of message.

/** @typedef {import('./frame.js').Frame} Frame */
/** @typedef {import('./commands.js').CommandEvent} CommandEvent */
/**
 * @typedef {object} NamedDragon a dragon of several
 * @property {string} name
 * @property {string} colour #rrggbb
 * @property {number} benches
 * @property {number} first_bench
 * @property {number} first_handle
 * @property {number} width_m
 * @property {number} hole_offset_m
 * @property {number[]} route x, y, x, y, …
 */
/** @typedef {{dragons?: string[], indices?: number[]}} Named of benches: with several dragons, their names and the indices within them */
/**
 * @typedef {object} Run the constant properties of a run
 * @property {number} run_id
 * @property {number} benches
 * @property {number} head_length_m
 * @property {number} body_length_m
 * @property {number} width_m
 * @property {number} hole_offset_m
 * @property {number} start_s
 * @property {number} end_s
 * @property {number} near_m
 * @property {number} margin_m
 * @property {boolean} guarded
 * @property {number} planned_speed_mps
 * @property {number} rate_hz
 * @property {number[]} route x, y, x, y, …
 * @property {[number, number, number, number]} view low and high corner of the part of the plane to show at first
 * @property {number[]} outline x, y, x, y, … of the stage's corners; empty without an outline
 * @property {number[][]} keep_out the same for each area to keep out of
 * @property {number[]} crowd x, y, x, y, … of the line of the crowd; empty without one
 * @property {NamedDragon[]} [dragons] of several dragons, the leading one first. The lengths and the route before are then its own.
 */
/** @typedef {{p50: number, p99: number, p999: number, max: number}} Percentiles */
/** @typedef {{travel_m: number, time_s: number, wall_s: number}} Arrival travel, its show time, and wall time until then */
/**
 * @typedef {{kind: 'unknown'} | ({kind: 'free', is_end: boolean} & Arrival)
 *   | ({kind: 'contact', benches: [number, number]} & Arrival & Named)
 *   | ({kind: 'guard_stop', benches: [number, number] | null} & Arrival & Named) | ({kind: 'rest'} & Arrival)} Outlook
 */
/**
 * @typedef {object} Server the server's status
 * @property {number} tick tick of these values
 * @property {number} rate_hz
 * @property {number} overruns
 * @property {number} behind_s
 * @property {Percentiles} lateness_us
 * @property {Percentiles} tick_us
 * @property {'server' | 'replay' | 'remote' | 'unknown'} source
 * @property {string} timecode
 * @property {string[]} stops
 */
/**
 * @typedef {object} Replay
 * @property {number} position_s wall time since the first frame of the recording
 * @property {number} length_s
 * @property {number} recorded_ms Unix time at which the frame was recorded
 * @property {number} pace recorded seconds per second
 * @property {boolean} paused
 * @property {boolean} at_end whether the replay stands at the end of the recording
 */
/** @typedef {{kind: 'none' | 'waiting' | 'working' | 'missing'} | {kind: 'at_end', for_good: boolean}} Guard */
/** @typedef {{name: string, level: 'off' | 'good' | 'warning' | 'danger', text: string}} Lamp */
/**
 * @typedef {Record<'pause' | 'resume' | 'hold' | 'release' | 'speed' | 'seek' | 'go', string | null>} Refusals the reason for which
 *   each command would be refused; null if it would be accepted
 */
/**
 * @typedef {object} Status the view's status, sent five times a second
 * @property {{state: 'waiting' | 'live' | 'silent' | 'gone' | 'ended' | 'failed', age_s: number | null, reason: string | null}} link
 * @property {{rate_hz: number, frames: number, lost: number, restarts: number, latency_us: Percentiles | null}} traffic
 * @property {Server | null} server
 * @property {Replay | null} replay position of a replay; null for any other source
 * @property {Guard} guard situation of the guard
 * @property {{level: 'calm' | 'good' | 'caution' | 'danger', word: string, cause: string, remedy: string | null}} standing how
 *   the show stands
 * @property {Lamp[]} lamps
 * @property {Refusals} refusals
 * @property {import('./cue_words.js').CueList | null} cues null without cues
 * @property {Outlook} outlook
 * @property {Arrival | null} possible_contact where the play of the hinges allows a contact first
 * @property {Clock | null} clock
 * @property {{clearance_m: number, time_s: number} | null} least
 * @property {{start_s: number, step_s: number, bins: number, changed: [number, number][]} | null} chart
 * @property {number} day_ms wall time of the view's machine since midnight
 * @property {{sequence: number, at_ms: number} | null} heard this page's newest acknowledgement, and when the view received it
 */
/**
 * @typedef {object} Clock the head is at this travel at this show time, and walks on at this speed
 * @property {number} travel_m
 * @property {number} time_s
 * @property {number} speed_mps
 */
/**
 * @typedef {object} PlannedClearance the planned clearance of a whole run, over the head's travel
 * @property {number} run_id
 * @property {boolean} is_complete
 * @property {number[]} curve travel and clearance, travel and clearance, …
 * @property {{travel_m: number, clearance_m: number, benches: [number, number]}[]} near_misses
 * @property {number} near_misses_dropped
 * @property {{travel_m: number, benches: [number, number]} | null} contact
 */
/**
 * @typedef {object} Alert
 * @property {number} number
 * @property {number} run_id
 * @property {string} kind
 * @property {number} time_s
 * @property {[number, number] | null} benches
 * @property {string[]} [dragons] of these benches, with several dragons
 * @property {number[]} [indices] of these benches within their dragons
 * @property {number | null} bench of an alert about one bench
 * @property {number | null} clearance_m
 * @property {[number, number] | null} point_m
 * @property {number | null} forecast_s
 */
/** @typedef {{start_s: number, step_s: number, least_m: Float64Array}} Chart NaN without a measurement */

const KEPT_ALERTS = 200;
const KEPT_COMMANDS = 100;

export class Show {
  /** @type {Frame | null} */ frame = null;
  /** Time of arrival, on the page's clock. */
  frame_ms = 0;
  /** Tick of the first frame in the present state. */
  state_tick = 0;
  /** @type {Run | null} */ run = null;
  /** @type {Status | null} */ status = null;
  /** Time of arrival, on the page's clock. */
  status_ms = 0;
  /** @type {Chart | null} */ chart = null;
  /** @type {PlannedClearance | null} */ plan = null;
  /** @type {Alert[]} oldest first */ alerts = [];
  /** @type {CommandEvent[]} oldest first */ commands = [];

  /** @param {Frame} frame */
  takeFrame(frame) {
    if (frame.state !== this.frame?.state || frame.run_id !== this.frame.run_id) this.state_tick = frame.tick;
    this.frame = frame;
    this.frame_ms = performance.now();
  }

  /** @param {Run} run */
  takeRun(run) {
    if (run.run_id !== this.run?.run_id) this.chart = null;
    if (run.run_id !== this.plan?.run_id) this.plan = null;
    this.run = run;
  }

  /** @param {PlannedClearance} plan */
  takePlan(plan) {
    this.plan = plan;
  }

  /** @param {Status} status */
  takeStatus(status) {
    this.status = status;
    this.status_ms = performance.now();
    const news = status.chart;
    if (news === null) return;
    if (
      this.chart?.start_s !== news.start_s ||
      this.chart.step_s !== news.step_s ||
      this.chart.least_m.length !== news.bins
    ) {
      this.chart = { start_s: news.start_s, step_s: news.step_s, least_m: new Float64Array(news.bins).fill(NaN) };
    }
    for (const [bin, least_m] of news.changed) this.chart.least_m[bin] = least_m;
  }

  /**
   * Records an alert. Returns whether it is new.
   * @param {Alert} alert
   */
  takeAlert(alert) {
    const last = this.alerts.at(-1);
    if (last !== undefined && alert.number <= last.number) return false;
    this.alerts.push(alert);
    if (this.alerts.length > KEPT_ALERTS) this.alerts.shift();
    return true;
  }

  /** @param {CommandEvent} command */
  takeCommand(command) {
    const last = this.commands.at(-1);
    if (last !== undefined && command.number <= last.number) return;
    this.commands.push(command);
    if (this.commands.length > KEPT_COMMANDS) this.commands.shift();
  }

  /** Drops alerts and commands. A restarted view numbers its own from 0. */
  forgetEvents() {
    this.alerts = [];
    this.commands = [];
  }

  /** The nearest pair of the frame with its names; `null` without one. */
  nearestPair() {
    const nearest = this.frame?.nearest ?? null;
    return nearest === null ? null : { ...nearest, ...namesOf(nearest.benches, this.runOfFrame()) };
  }

  /** The frame's run, if it is known. */
  runOfFrame() {
    return this.frame !== null && this.run?.run_id === this.frame.run_id ? this.run : null;
  }
}

/** The dragons of benches; nothing with one dragon. @param {readonly number[]} benches @param {Run | null} run @returns {Named} */
export function namesOf(benches, run) {
  const dragons = run?.dragons;
  if (dragons === undefined) return {};
  const members = benches.map((bench) => dragons.findLast(({ first_bench }) => first_bench <= bench) ?? dragons[0]);
  return { dragons: members.map(({ name }) => name), indices: members.map(({ first_bench }, at) => benches[at] - first_bench) };
}
