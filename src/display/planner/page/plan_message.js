// @ts-check
// What the planner answers. All lengths are in metres, all times in seconds of plan time.

/** @typedef {import('./show.js').Run} Run */
/** @typedef {'start' | 'whole' | 'heading' | 'corner' | 'end' | 'middle' | 'arc_radius' | 'arc_end' | 'spiral_end' | 'spiral_start'
 *   | 'pitch' | 'turn_circle' | 'outline' | 'keep_out' | 'crowd' | 'outline_middle' | 'keep_out_middle' | 'crowd_middle'} HandleKind */
/** @typedef {{dragon: number, kind: HandleKind, at: number, point: number}} HandleId */
/** @typedef {{keys: (string | number)[], label: string, value: number, unit: string}} Field a number of the configuration */
/** @typedef {HandleId & {x_m: number, y_m: number, name: string, fields: Field[], can_delete: boolean}} Handle */
/** @typedef {{kind: 'move', handle: HandleId, to_m: [number, number]} | {kind: 'delete', handle: HandleId}
 *   | {kind: 'set', keys: (string | number)[], value: number} | {kind: 'put', puts: Put[]}
 *   | {kind: 'mirror' | 'reverse' | 'close' | 'remove_dragon', dragon: number} | {kind: 'add_dragon'}
 *   | {kind: 'insert', dragon: number, after: number | null, segment: 'line' | 'arc' | 'spiral' | 'turnaround'}
 *   | {kind: 'through', dragon: number, points_m: [number, number][], radius_m: number}
 *   | {kind: 'border', border: 'outline' | 'keep_out' | 'crowd', points_m: [number, number][]}} Edit */
/** @typedef {{keys: (string | number)[], value: unknown}} Put a value for a place of the text; null removes what is there */
/** @typedef {{of: 'contact' | 'stop', dragon: number, words: string, puts: Put[]}} Fix */
/** @typedef {{type: 'asked', number: number, state: 'running' | 'done' | 'failed' | 'cancelled', elapsed_s?: number,
 *   share?: number | null, words?: string, puts?: Put[] | null}} Asked */
/** @typedef {{benches: [number, number], words: string}} Pair */
/**
 * @typedef {object} Contact
 * @property {'found' | 'none' | 'searching' | 'unfinished'} state
 * @property {number} [to_s] up to here there is none
 * @property {number} [time_s]
 * @property {Pair} [pair]
 * @property {[number, number]} [point_m]
 * @property {[number[], number[]]} [boards] x, y, x, y, … of the corners of both
 */
/** @typedef {{time_s: number, handles: number[]}} Pose x, y, x, y, … */
/** @typedef {{run?: Run, handles: number[]}} Saved the saved version at the time of the pose; its run, if it is new */
/**
 * @typedef {object} RouteFacts
 * @property {string | null} name of the dragon, with several
 * @property {'spiral' | 'turnaround' | 'path' | 'drawing'} kind
 * @property {boolean} closed
 * @property {number} length_m
 * @property {number | null} tightest_radius_m
 * @property {{because: string, time_s: number, point_m: [number, number]} | null} stops
 */
/**
 * @typedef {object} PlanMessage
 * @property {'plan'} type
 * @property {number} number
 * @property {string} text
 * @property {Run} run
 * @property {Handle[]} handles
 * @property {RouteFacts[]} routes
 * @property {[number, number]} times_s
 * @property {Contact} contact
 * @property {Pose} pose
 * @property {Saved} [saved]
 */
/** @typedef {{kind: 'outline' | 'keep_out' | 'crowd', time_s: number, bench: string, point_m: [number, number], distance_m?: number,
 *   clear_m?: number}} BorderFact */
/** @typedef {{time_s: number, clearance_m: number, pair: Pair, point_m: [number, number]}} Miss */
/** @typedef {{ratio?: number, handle?: number, time_s?: number, unknown?: string}} Speed */
/** @typedef {{type: 'pose', number: number, pose: Pose, saved?: Saved} | {type: 'mistake', number: number, reason: string}
 *   | {type: 'contact', number: number, contact: Contact} | {type: 'curve', number: number, points: number[], is_complete: boolean}
 *   | {type: 'borders', number: number, borders: BorderFact[]} | {type: 'misses', number: number, misses: Miss[]}
 *   | {type: 'speeds', number: number, speeds: Speed[]}
 *   | {type: 'fixes', number: number, fixes: Fix[]} | Asked | PlanMessage} Answer */

export {};
