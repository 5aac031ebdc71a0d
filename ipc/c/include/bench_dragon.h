/*
 * The bench dragon's bus for C99, C++17 and every language that calls C: poses in place, commands,
 * alerts.
 *
 * A bench dragon is a chain of benches, hinged end to end, that walks along a route. A server
 * simulates the show. At a fixed rate (a tick) it publishes a frame with the positions and velocities
 * of all hinges, called handles, into shared memory. A client opens an instance (a named server) and
 * reads frame after frame. A client never delays the server:
 *
 *     bd_show_t *show;
 *     bd_frame_t *frame;
 *     bd_source_state_t source = BD_SOURCE_PUBLISHING;
 *     bd_result_t result = bd_show_open(NULL, "hinge-printer", 0, &show);
 *     while (source == BD_SOURCE_PUBLISHING && (result == BD_OK || result == BD_NOTHING)) {
 *       result = bd_show_wait(show, 1000000000, &frame);
 *       if (result == BD_OK) {
 *         const bd_handle_state_t *front_hinge = bd_frame_handles(frame, NULL);
 *         printf("%.3f %.3f\n", front_hinge->position_m[0], front_hinge->position_m[1]);
 *         bd_frame_release(frame);
 *       } else if (result == BD_NOTHING) {
 *         result = bd_show_source(show, 1000000000, &source);
 *       }
 *     }
 *     bd_show_close(show);
 *
 * Units: metres, seconds, radians; x right, y away, z up; angles counter-clockwise from +x. Times are
 * integers in nanoseconds. Speeds are metres per show second; multiply them by the header's time_scale
 * for wall time.
 *
 * Results: BD_OK is 0. BD_NOTHING is not an error. After every other result bd_last_error() returns
 * the text. Unless the result is BD_OK, pointer results are NULL and other results are unchanged; only
 * bd_show_command also writes the reply after BD_REFUSED.
 *
 * Lifetimes: the caller releases every object once: a client with bd_show_close, a frame with
 * bd_frame_release, a description with bd_description_release. Frames are lent from shared memory, at
 * most 4 at a time. A frame stays valid until it is released, even after the server has ended and after
 * bd_show_close. The process remains a member of the bus until it has released its last frame. After
 * a client is killed or crashes, the next process on the bus removes its remains.
 *
 * The end: the last frame of a run that ends in order has the state BD_ENDED. A server that was killed
 * sends no such frame. bd_show_source distinguishes ended, lost and hanging servers.
 *
 * Threads: every function may be called from any thread, and objects may be used, released and closed by
 * other threads than those that opened them. Several threads may wait for frames; each frame goes to one
 * of them. Calls for alerts exclude each other; four commands may wait at a time. bd_show_close ends every wait with
 * BD_CLOSED, and so ends every later call on that client. No thread may use a frame or a description
 * after its release. Each thread has its own text of bd_last_error. A child process after fork() must
 * open its own client: calls on an inherited one fail with BD_INVALID_ARGUMENT.
 */

#ifndef BENCH_DRAGON_H
#define BENCH_DRAGON_H

#include <stddef.h>
#include <stdint.h>

/* Generated from the crates bench-dragon-ipc (enums) and bench-dragon-c (everything else), by its test `header`. */

/**
 * State of the show.
 */
typedef enum {
  /**
   * The head walks.
   */
  BD_RUNNING = 0,
  /**
   * Paused by the operator, or by a timecode that stands. `resume` continues.
   */
  BD_PAUSED = 1,
  /**
   * Stopped for safety: by a hold, which only `release` lifts, or at the end of the guard's grant.
   */
  BD_HELD = 2,
  /**
   * The show has reached the end of the route, of the feasible travel or of the requested time.
   */
  BD_FINISHED = 3,
  /**
   * The head still walks and brakes, because of a pause, a hold, a stop or the timecode.
   */
  BD_STOPPING = 4,
  /**
   * The run has ended in order. This is its last frame.
   */
  BD_ENDED = 5,
  /**
   * The show waits at its start for its first `release`. It is calm: no safety stop.
   */
  BD_READY = 6,
  /**
   * The show waits at a cue for GO. It is calm: no safety stop.
   */
  BD_WAITING = 7,
} bd_show_state_t;

/**
 * What one dragon does.
 */
typedef enum {
  /**
   * It stands: it has not left yet, or the whole show stands.
   */
  BD_DRAGON_STANDING = 0,
  /**
   * It walks.
   */
  BD_DRAGON_WALKING = 1,
  /**
   * It has reached its end.
   */
  BD_DRAGON_ENDED = 2,
} bd_dragon_state_t;

/**
 * Kind of an alert.
 */
typedef enum {
  /**
   * Two benches came nearer than the configured `near_m`.
   */
  BD_ALERT_NEAR = 0,
  /**
   * Two benches touched.
   */
  BD_ALERT_CONTACT = 1,
  /**
   * Two benches that had touched are apart again.
   */
  BD_ALERT_PARTED = 2,
  /**
   * The show is held.
   */
  BD_ALERT_HELD = 3,
  /**
   * The frames do not agree with the published description.
   */
  BD_ALERT_FAULT = 4,
  /**
   * The source of the frames was restarted.
   */
  BD_ALERT_RESTARTED = 5,
  /**
   * A board left the outline of the stage, while the bench before it is inside.
   */
  BD_ALERT_OUTSIDE = 6,
  /**
   * A board that was outside is inside the outline of the stage, and so is the bench behind it.
   */
  BD_ALERT_INSIDE = 7,
  /**
   * A board entered an area to keep out of, while the bench before it is not in one.
   */
  BD_ALERT_KEEP_OUT = 8,
  /**
   * A board came nearer to a border of the stage than the configured `clear_m`, while the bench
   * before it is clear. The line of the crowd counts without a `clear_m` too.
   */
  BD_ALERT_TOO_NEAR = 9,
  /**
   * A board is clear again of an area or a border, and so is the bench behind it.
   */
  BD_ALERT_CLEAR = 10,
} bd_alert_kind_t;

/**
 * Kind of a command.
 */
typedef enum {
  /**
   * Stop walking until `resume`.
   */
  BD_COMMAND_PAUSE = 0,
  /**
   * Walk on after `pause`.
   */
  BD_COMMAND_RESUME = 1,
  /**
   * Walk at this speed of the head, in metres per show second, 0 to 10.
   */
  BD_COMMAND_SPEED = 2,
  /**
   * Seek to this show time, in seconds.
   */
  BD_COMMAND_SEEK = 3,
  /**
   * Stop for safety. Only `release` lifts the hold.
   */
  BD_COMMAND_HOLD = 4,
  /**
   * Lift a hold, or start a show that is ready.
   */
  BD_COMMAND_RELEASE = 5,
  /**
   * End the server. The head comes to rest first, and the last frame of the run has the state
   * `ended`.
   */
  BD_COMMAND_STOP = 6,
  /**
   * Play at this pace: plan time per show time. A replay does not record the commands that it
   * takes.
   */
  BD_COMMAND_PACE = 12,
  /**
   * Walk on from a cue that waits.
   */
  BD_COMMAND_GO = 13,
} bd_command_t;

/**
 * Reason for which a server refuses a command. Later versions may add reasons.
 */
typedef enum {
  /**
   * The command was accepted.
   */
  BD_ACCEPTED = 0,
  /**
   * The server does not support this kind of command.
   */
  BD_REFUSED_UNKNOWN = 1,
  /**
   * The value is outside the allowed range, or NaN.
   */
  BD_REFUSED_OUT_OF_RANGE = 2,
  /**
   * The show is held. Only `release` lifts the hold.
   */
  BD_REFUSED_HELD = 3,
  /**
   * There is no hold to release, and the show does not wait at its start.
   */
  BD_REFUSED_NOT_HELD = 4,
  /**
   * The show is finished. A `seek` starts it again.
   */
  BD_REFUSED_FINISHED = 5,
  /**
   * The server accepts no grants, because it was started without `--guarded`.
   */
  BD_REFUSED_NOT_GUARDED = 6,
  /**
   * The server is guarded, and the guard has not yet proved that the benches are apart at the
   * sought travel. The refused seek asks the guard to prove it. The same seek is accepted a little
   * later, unless the benches are not apart there.
   */
  BD_REFUSED_NOT_PROVED = 7,
  /**
   * The grant is for another run.
   */
  BD_REFUSED_OTHER_RUN = 8,
  /**
   * The guard holds the dragon. It walks on with the guard's next grant; where the proven travel
   * has ended, only a seek moves it.
   */
  BD_REFUSED_HELD_BY_GUARD = 9,
  /**
   * The source replays a recording. It can be paused, sought, played at another pace and stopped,
   * but not changed.
   */
  BD_REFUSED_REPLAYED = 10,
  /**
   * The source is on another host, which does not answer.
   */
  BD_REFUSED_UNREACHABLE = 11,
  /**
   * The source is on another host, and its bridge accepts no commands: it was started without
   * `--allow-commands`.
   */
  BD_REFUSED_NOT_TAKEN = 12,
  /**
   * More commands at a time than a bridge forwards to another host.
   */
  BD_REFUSED_TOO_MANY = 13,
  /**
   * The show follows timecode, which determines the show time. The timecode would undo a seek
   * immediately.
   */
  BD_REFUSED_FOLLOWED = 14,
  /**
   * The show waits at its start. Only `release` starts it.
   */
  BD_REFUSED_READY = 15,
  /**
   * The show does not stand at a cue that waits.
   */
  BD_REFUSED_NOTHING_WAITS = 16,
  /**
   * The show is paused. `resume` continues.
   */
  BD_REFUSED_PAUSED = 17,
} bd_refusal_t;

/**
 * Kind of an event.
 */
typedef enum {
  /**
   * Stop walking until `resume`.
   */
  BD_EVENT_PAUSE = 0,
  /**
   * Walk on after `pause`.
   */
  BD_EVENT_RESUME = 1,
  /**
   * Walk at this speed of the head, in metres per show second, 0 to 10.
   */
  BD_EVENT_SPEED = 2,
  /**
   * Seek to this show time, in seconds.
   */
  BD_EVENT_SEEK = 3,
  /**
   * Stop for safety. Only `release` lifts the hold.
   */
  BD_EVENT_HOLD = 4,
  /**
   * Lift a hold, or start a show that is ready.
   */
  BD_EVENT_RELEASE = 5,
  /**
   * End the server. The head comes to rest first, and the last frame of the run has the state
   * `ended`.
   */
  BD_EVENT_STOP = 6,
  /**
   * The guard has proved a travel, from the first to the second value in metres.
   */
  BD_EVENT_GRANT = 7,
  /**
   * The timecode that the server follows makes the show stand still. First value: 1 if the timecode
   * determines the show time, else 0. Second value: the time scale.
   */
  BD_EVENT_STAND = 8,
  /**
   * The timecode makes the show run on. Values as for `stand`.
   */
  BD_EVENT_FOLLOW = 9,
  /**
   * The run begins. This is always the first event.
   */
  BD_EVENT_START = 10,
  /**
   * The run has ended in order. This is the last event, at the last tick of the run.
   */
  BD_EVENT_END = 11,
  /**
   * Play at this pace: plan time per show time. A replay does not record the commands that it
   * takes.
   */
  BD_EVENT_PACE = 12,
  /**
   * Walk on from a cue that waits.
   */
  BD_EVENT_GO = 13,
  /**
   * The show has reached a cue, by walking or by a seek to it. First value: its number in the
   * configuration, from 0. Second value: its plan time in seconds.
   */
  BD_EVENT_CUE = 14,
} bd_event_kind_t;

/**
 * The kind of source that publishes the frames.
 */
typedef enum {
  /**
   * A server, which simulates the show.
   */
  BD_KIND_SERVER = 0,
  /**
   * A replay of a recording.
   */
  BD_KIND_REPLAY = 1,
  /**
   * A bridge that receives the frames of another host.
   */
  BD_KIND_REMOTE = 2,
} bd_source_kind_t;

/**
 * State of the guard.
 */
typedef enum {
  /**
   * The server is not guarded.
   */
  BD_GUARD_NONE = 0,
  /**
   * The server waits for grants, and no guard runs.
   */
  BD_GUARD_MISSING = 1,
  /**
   * A guard runs.
   */
  BD_GUARD_RUNNING = 2,
} bd_guard_state_t;

/**
 * State of the timecode that the server follows.
 */
typedef enum {
  /**
   * The server follows no timecode.
   */
  BD_TIMECODE_NONE = 0,
  /**
   * No timecode has arrived yet; the show stands.
   */
  BD_TIMECODE_WAITING = 1,
  /**
   * The timecode runs, and the show follows.
   */
  BD_TIMECODE_LOCKED = 2,
  /**
   * The timecode stands, and so does the show.
   */
  BD_TIMECODE_STANDING = 3,
  /**
   * The timecode is lost. The show runs on at its own speed, unless it was standing.
   */
  BD_TIMECODE_LOST = 4,
} bd_timecode_state_t;

/**
 * The protocol of the timecode.
 */
typedef enum {
  /**
   * The server follows no timecode.
   */
  BD_PROTOCOL_NONE = 0,
  /**
   * Art-Net (`ArtTimeCode`).
   */
  BD_PROTOCOL_ART_NET = 1,
  /**
   * Open Sound Control.
   */
  BD_PROTOCOL_OSC = 2,
  /**
   * Linear timecode, as sound.
   */
  BD_PROTOCOL_LTC = 3,
} bd_timecode_kind_t;

/**
 * Reason for which the head stands or brakes. A bit of `stops`.
 */
typedef enum {
  /**
   * The operator's pause.
   */
  BD_STOP_PAUSED = 1,
  /**
   * A safety hold. `release` lifts it.
   */
  BD_STOP_HELD = 2,
  /**
   * The head is at the end of the granted travel.
   */
  BD_STOP_GUARD_LIMIT = 4,
  /**
   * The timecode stands, or has not arrived yet.
   */
  BD_STOP_TIMECODE = 8,
  /**
   * The server is ending.
   */
  BD_STOP_ENDING = 16,
  /**
   * The end of the route, of the feasible travel or of the requested time.
   */
  BD_STOP_RUN_END = 32,
  /**
   * The show waits at its start. `release` starts it.
   */
  BD_STOP_READY = 64,
  /**
   * The server was restarted, and has held the show since. The show is held too.
   */
  BD_STOP_RESTARTED = 128,
  /**
   * The show waits at a cue. `go` lets it walk on.
   */
  BD_STOP_WAITING = 256,
} bd_stop_t;

/**
 * The kind of program that sends a command.
 */
typedef enum {
  /**
   * A client of the library, in Rust, C or Python, without a more specific kind.
   */
  BD_SENDER_CLIENT = 0,
  /**
   * `bench-dragon ctl`.
   */
  BD_SENDER_CTL = 1,
  /**
   * A browser page of `bench-dragon view`.
   */
  BD_SENDER_PAGE = 2,
  /**
   * `bench-dragon watch`.
   */
  BD_SENDER_WATCH = 3,
  /**
   * A program on another host, through `bench-dragon bridge zenoh`.
   */
  BD_SENDER_ZENOH = 4,
  /**
   * The timecode that the server follows.
   */
  BD_SENDER_TIMECODE = 5,
  /**
   * The guard, `bench-dragon monitor --guard`.
   */
  BD_SENDER_GUARD = 6,
  /**
   * A signal to the server's process, such as Ctrl-C.
   */
  BD_SENDER_SIGNAL = 7,
  /**
   * The server itself.
   */
  BD_SENDER_SERVER = 8,
  /**
   * `bench-dragon show --auto-go`.
   */
  BD_SENDER_SHOW = 9,
  /**
   * A desk or controller, through `bench-dragon bridge osc --listen`.
   */
  BD_SENDER_OSC = 10,
  /**
   * A viewer, through `bench-dragon bridge foxglove --steer`.
   */
  BD_SENDER_FOXGLOVE = 11,
} bd_sender_t;

/**
 * Greatest number of dragons of a show.
 */
#define BD_MAX_DRAGONS 32

/**
 * Value of `bench_a` and `bench_b` in an alert without benches, and of `bench_b` in an alert about one bench.
 */
#define BD_NO_BENCH 4294967295

/**
 * `kind` of an event for a command that the source does not support.
 */
#define BD_EVENT_UNKNOWN 4294967295

/**
 * Result of a call. Later versions may add results; treat an unknown number as `BD_FAILED`.
 */
typedef enum {
  /**
   * Success.
   */
  BD_OK = 0,
  /**
   * Nothing new is available, or nothing arrived in time. Not an error.
   */
  BD_NOTHING = 1,
  /**
   * No server runs on the instance, or none has replied. Try again later.
   */
  BD_NO_SERVER = 2,
  /**
   * The server refused the command. The reply has the reason.
   */
  BD_REFUSED = 3,
  /**
   * An argument is NULL, out of range or not valid text.
   */
  BD_INVALID_ARGUMENT = 4,
  /**
   * Too many frames are held. Release one.
   */
  BD_TOO_MANY_FRAMES = 5,
  /**
   * The bus has its greatest allowed number of clients.
   */
  BD_TOO_MANY_CLIENTS = 6,
  /**
   * The server is of another version, whose data has another layout.
   */
  BD_VERSION_MISMATCH = 7,
  /**
   * This user may not use the instance. Run as the user who runs the server.
   */
  BD_PERMISSION_DENIED = 8,
  /**
   * `/dev/shm` is full or cannot be used.
   */
  BD_SHARED_MEMORY = 9,
  /**
   * This process may not open as many files as it needs.
   */
  BD_TOO_FEW_FILES = 10,
  /**
   * The instance's directory is not usable.
   */
  BD_DIRECTORY = 11,
  /**
   * Any other error.
   */
  BD_FAILED = 12,
  /**
   * The client is closed.
   */
  BD_CLOSED = 13,
} bd_result_t;

/**
 * Whether the source publishes, and if not, why.
 */
typedef enum {
  /**
   * A source runs, and the newest frame is recent.
   */
  BD_SOURCE_PUBLISHING = 0,
  /**
   * A source runs, but its newest frame is old: the process is suspended, stuck, or still starting.
   */
  BD_SOURCE_HANGING = 1,
  /**
   * The run has ended in order: the last frame that was read has the state `BD_ENDED`.
   */
  BD_SOURCE_ENDED = 2,
  /**
   * No source runs, and the run has not ended in order: the process was killed or has failed.
   */
  BD_SOURCE_LOST = 3,
} bd_source_state_t;

/**
 * Relation of a frame to the one that the same reader received before it.
 */
typedef enum {
  /**
   * The first frame that this reader has received.
   */
  BD_FIRST = 0,
  /**
   * The next tick of the same run.
   */
  BD_NEXT = 1,
  /**
   * The same run, but frames between the two did not reach the reader.
   */
  BD_LOST = 2,
  /**
   * Another run: the source was restarted. The number of frames lost from either run is unknown.
   */
  BD_RESTARTED = 3,
} bd_continuity_t;

/**
 * Configuration of a run, as the server published it.
 */
typedef struct bd_description_t bd_description_t;

/**
 * A frame. Nothing is copied, and nothing in it changes while it is held. Any thread may read and release it.
 */
typedef struct bd_frame_t bd_frame_t;

/**
 * A client of one instance of the bus.
 *
 * Any thread may use it, also while other threads wait. Each frame goes to one of the threads that read. Close it with
 * `bd_show_close`, from any thread. A forked child must open its own.
 */
typedef struct bd_show_t bd_show_t;

/**
 * A dragon of a frame. 32 bytes. Its handles in the frame are `bench_count + 1` from `first_handle` on.
 */
typedef struct {
  /**
   * Signed arc length that its head has walked since t = 0, in metres.
   */
  double travel_m;
  /**
   * Speed of its head in metres per show second; 0 while it stands.
   */
  double speed_mps;
  /**
   * Index of its first handle in the frame.
   */
  uint32_t first_handle;
  /**
   * Number of its benches; it has one handle more.
   */
  uint32_t bench_count;
  /**
   * A `bd_dragon_state_t`.
   */
  uint32_t state;
  /**
   * 0.
   */
  uint32_t reserved;
} bd_dragon_motion_t;

/**
 * Values of a frame that concern the whole show, and one entry for each dragon. 1120 bytes.
 */
typedef struct {
  /**
   * Random number of the run, under 2^53. It changes when the source is restarted.
   */
  uint64_t run_id;
  /**
   * Number of the frame in its run, from 0, without a gap. A jump means that this reader lost frames.
   */
  uint64_t tick;
  /**
   * Show time in nanoseconds.
   */
  int64_t show_time_ns;
  /**
   * `CLOCK_MONOTONIC` instant at which the tick was due, in nanoseconds.
   */
  uint64_t scheduled_ns;
  /**
   * `CLOCK_MONOTONIC` instant at which the frame was sent, in nanoseconds.
   */
  uint64_t published_ns;
  /**
   * Signed arc length that the head of the leading dragon has walked since t = 0, in metres.
   */
  double head_travel_m;
  /**
   * Speed of that head in metres per show second; 0 while it stands.
   */
  double head_speed_mps;
  /**
   * Show seconds per wall-clock second.
   */
  double time_scale;
  /**
   * Number of benches of all dragons; the frame has one handle more for each dragon.
   */
  uint32_t bench_count;
  /**
   * A `bd_show_state_t`.
   */
  uint32_t state;
  /**
   * Place of the show on its course, in metres: the one number on which the poses of all dragons depend. Of several dragons it
   * is plan time times the planned speed of the leading dragon. Of one dragon it is the travel of its head.
   */
  double course_m;
  /**
   * Speed along the course, in metres per show second; 0 while the show stands.
   */
  double course_mps;
  /**
   * Number of dragons.
   */
  uint32_t dragon_count;
  /**
   * 1 where the course is a plan, 0 where it is the travel of the only head.
   */
  uint32_t is_plan;
  /**
   * The dragons, the leading one first; entries beyond their number are 0.
   */
  bd_dragon_motion_t dragons[BD_MAX_DRAGONS];
} bd_frame_header_t;

/**
 * Position and velocity of one handle. 48 bytes. x right, y away, z up; z is 0 on a flat stage.
 *
 * A dragon of N benches has N + 1 handles. Handle i is the front hinge of bench i, and handle N the rear hinge of the
 * last bench.
 */
typedef struct {
  /**
   * Position x, y, z in metres.
   */
  double position_m[3];
  /**
   * Velocity in metres per show second; 0 while the head stands.
   */
  double velocity_mps[3];
} bd_handle_state_t;

/**
 * Position and motion of one bench.
 */
typedef struct {
  /**
   * Centre of the board in metres.
   */
  double centre_m[3];
  /**
   * Direction from the rear handle to the front one, in radians counter-clockwise from +x, -pi to pi.
   */
  double heading_rad;
  /**
   * Velocity of the centre in metres per show second; 0 while the head stands.
   */
  double velocity_mps[3];
  /**
   * Rate of the heading in radians per show second, counter-clockwise.
   */
  double turn_rate_radps;
  /**
   * Angle by which the front handle is above the rear one, seen from there, in radians: 0 on level ground.
   */
  double pitch_rad;
} bd_bench_state_t;

/**
 * State and timing of the server. Published ten times a second and once more at the end.
 */
typedef struct {
  /**
   * Run of the server.
   */
  uint64_t run_id;
  /**
   * Last tick published.
   */
  uint64_t tick;
  /**
   * Show time of that tick in nanoseconds.
   */
  int64_t show_time_ns;
  /**
   * Number of periods that were missed since the start of the run. After a few missed periods show time jumps
   * forward. After a longer standstill the show is behind; see `behind_ns`.
   */
  uint64_t overruns;
  /**
   * Time by which the show is behind the clock, in nanoseconds of wall time: the rest of standstills, for which the
   * show makes up.
   */
  uint64_t behind_ns;
  /**
   * Greatest value of `behind_ns` since the start of the run.
   */
  uint64_t most_behind_ns;
  /**
   * Median of the lateness of all ticks since the start of the run, in nanoseconds. Lateness is the time from the due
   * instant to the start of the tick.
   */
  uint64_t lateness_p50_ns;
  /**
   * 99th percentile of the lateness, in nanoseconds.
   */
  uint64_t lateness_p99_ns;
  /**
   * 99.9th percentile of the lateness, in nanoseconds.
   */
  uint64_t lateness_p999_ns;
  /**
   * Greatest lateness, in nanoseconds.
   */
  uint64_t lateness_max_ns;
  /**
   * Travel up to which a guarded server may move the head, in metres; NaN for a server that is not guarded.
   */
  double granted_to_m;
  /**
   * Travel at which the proven travel ends permanently, in metres; NaN where the guard has not reached it.
   */
  double guard_end_m;
  /**
   * Ticks per second of wall time.
   */
  uint32_t rate_hz;
  /**
   * A `bd_show_state_t`.
   */
  uint32_t state;
  /**
   * Process id of the server.
   */
  uint32_t pid;
  /**
   * A `bd_source_kind_t`.
   */
  uint32_t source;
  /**
   * A `bd_guard_state_t`.
   */
  uint32_t guard;
  /**
   * A `bd_timecode_state_t`.
   */
  uint32_t timecode;
  /**
   * A `bd_timecode_kind_t`.
   */
  uint32_t timecode_kind;
  /**
   * Reasons for which the head stands or brakes, as bits: a sum of `bd_stop_t`.
   */
  uint32_t stops;
} bd_status_t;

/**
 * One alert: an event that a monitor detected. 72 bytes.
 */
typedef struct {
  /**
   * Run in which it happened.
   */
  uint64_t run_id;
  /**
   * First tick at which the event held.
   */
  uint64_t tick;
  /**
   * Show time of the event in nanoseconds: exact for pairs that touch or part and boards at borders of the stage, if the head
   * walked; the frame's show time for the other kinds.
   */
  int64_t show_time_ns;
  /**
   * Show time of the forecast contact in nanoseconds; `INT64_MIN` where none lies ahead, or none is known yet.
   */
  int64_t forecast_ns;
  /**
   * Clearance of the two benches in metres, negative where they overlap. For one bench: distance of its board from the border of the
   * stage, 0 beyond it. 0 for an alert without benches.
   */
  double clearance_m;
  /**
   * Point midway between the nearest points of the two boards, in metres. For one bench: a point of its board beyond the border of the
   * stage, or nearest to it, or of the border in the board. 0 for an alert without benches.
   */
  double point_m[2];
  /**
   * A `bd_alert_kind_t`.
   */
  uint32_t kind;
  /**
   * The lower bench index, the only one, or `BD_NO_BENCH`.
   */
  uint32_t bench_a;
  /**
   * The higher bench index, or `BD_NO_BENCH`.
   */
  uint32_t bench_b;
  /**
   * Always 0.
   */
  uint32_t reserved;
} bd_alert_t;

/**
 * The server's reply to a command. 40 bytes.
 */
typedef struct {
  /**
   * Run of the server that replies.
   */
  uint64_t run_id;
  /**
   * Tick from which an accepted command holds; for a refused command, the tick at which it was refused.
   */
  uint64_t tick;
  /**
   * Least allowed value, after `BD_REFUSED_OUT_OF_RANGE`; else 0.
   */
  double lowest;
  /**
   * Greatest allowed value, after `BD_REFUSED_OUT_OF_RANGE`; else 0.
   */
  double highest;
  /**
   * A `bd_refusal_t`.
   */
  uint32_t refusal;
  /**
   * Always 0.
   */
  uint32_t reserved;
} bd_reply_t;

/**
 * One event: a command and its outcome, or the start or the end of the run. 120 bytes.
 */
typedef struct {
  /**
   * Run of the source.
   */
  uint64_t run_id;
  /**
   * Number of the event in its run, from 0, without a gap. A jump means that this reader lost events.
   */
  uint64_t number;
  /**
   * Tick from which an accepted command holds; for a refused command, the tick at which it was refused.
   */
  uint64_t tick;
  /**
   * Show time of the event, at the start of its tick, in nanoseconds.
   */
  int64_t show_time_ns;
  /**
   * Wall-clock time of the event: nanoseconds since 1970-01-01 00:00 UTC.
   */
  int64_t wall_ns;
  /**
   * Number of periods that the run missed before this tick.
   */
  uint64_t overruns;
  /**
   * Values of the command in their order; 0 for unused ones. For a start: show time in seconds, travel in metres, speed in
   * metres per show second, and the show time at which the run ends, or NaN.
   */
  double values[4];
  /**
   * Least allowed value, after `BD_REFUSED_OUT_OF_RANGE`; else 0.
   */
  double lowest;
  /**
   * Greatest allowed value, after `BD_REFUSED_OUT_OF_RANGE`; else 0.
   */
  double highest;
  /**
   * A `bd_event_kind_t`, or `BD_EVENT_UNKNOWN`.
   */
  uint32_t kind;
  /**
   * A `bd_sender_t`.
   */
  uint32_t sender;
  /**
   * Process id of the sender; 0 if unknown.
   */
  uint32_t pid;
  /**
   * A `bd_refusal_t`.
   */
  uint32_t refusal;
  /**
   * Bits. For a grant, 1: it is final. For a start, 1: held, 2: paused, 4: guarded, 8: follows timecode, 16: ready, 32:
   * restarted, 64: stays at its end. Else 0.
   */
  uint32_t flags;
  /**
   * Always 0.
   */
  uint32_t reserved;
} bd_command_event_t;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Returns the error text of the last call of this thread whose result was neither `BD_OK` nor `BD_NOTHING`. The text is
 * one line in UTF-8, never NULL, and empty if no call has failed. Valid until the next failing call of this thread.
 */
const char *bd_last_error(void);

/**
 * Returns the version of this library, such as "0.1.0". Valid until the process ends.
 */
const char *bd_version(void);

/**
 * Opens an instance of the bus as a client. `instance` is 1 to 24 characters of a-z, 0-9 and -; NULL is the default,
 * "dragon". `name` has 1 to 128 printable ASCII characters and identifies this client in lists of processes.
 *
 * Waits for a server at most `timeout_ns` nanoseconds; 0 does not wait. An open client outlives its server: the frames
 * of the next server follow, with `BD_RESTARTED`.
 *
 * `BD_NO_SERVER` if no server appeared in time, `BD_INVALID_ARGUMENT` for a bad name, or another error of `bd_result_t`.
 * `show` is NULL unless the result is `BD_OK`.
 *
 * `instance` and `name` are strings in UTF-8 with a terminating zero. They are copied.
 */
bd_result_t bd_show_open(const char *instance,
                         const char *name,
                         uint64_t timeout_ns,
                         bd_show_t **show);

/**
 * Closes a client, from any thread. Every wait of other threads ends with `BD_CLOSED`, and so does every later call on
 * the client. Held frames stay valid until they are released. NULL and a closed client have no effect.
 */
void bd_show_close(bd_show_t *show);

/**
 * Returns in `state` whether the source publishes, and if not, why. Call it after `bd_show_wait` has returned
 * `BD_NOTHING`: frames that were not read yet do not count. `limit_ns` is the age in nanoseconds from which the newest
 * frame is old: several periods of the server.
 */
bd_result_t bd_show_source(const bd_show_t *show,
                           uint64_t limit_ns,
                           bd_source_state_t *state);

/**
 * Returns in `descriptor` a file descriptor that is readable when a frame may be unread, for `poll`, `epoll` and event
 * loops. It also becomes readable when the client is closed. Call `bd_show_next` until it returns `BD_NOTHING`: that
 * makes the descriptor unreadable again. Do not read or close it. It ends with the client.
 *
 * The first call starts a thread that sleeps until frames arrive. The server is not affected.
 */
bd_result_t bd_show_descriptor(const bd_show_t *show,
                               int *descriptor);

/**
 * Returns the oldest unread frame in `frame`. Never waits.
 *
 * `BD_NOTHING` if all frames are read, `BD_TOO_MANY_FRAMES` if 4 frames are held. `frame` is NULL unless the result is
 * `BD_OK`.
 */
bd_result_t bd_show_next(const bd_show_t *show,
                         bd_frame_t **frame);

/**
 * Returns the newest unread frame in `frame`. Older frames are dropped unread and do not count as lost. Never waits.
 *
 * `BD_NOTHING` if all frames are read, `BD_TOO_MANY_FRAMES` if 4 frames are held. `frame` is NULL unless the result is
 * `BD_OK`.
 */
bd_result_t bd_show_latest(const bd_show_t *show,
                           bd_frame_t **frame);

/**
 * Returns the oldest unread frame in `frame`. Waits for one at most `timeout_ns` nanoseconds.
 *
 * A signal ends the wait early with `BD_NOTHING`. The wait lasts through a restart of the server. One system call of the
 * server wakes all readers that wait; a reader that only polls costs the server nothing. After `BD_NOTHING`,
 * `bd_show_source` returns whether the server has ended, is lost, or hangs.
 *
 * `BD_NOTHING` if no frame arrived, `BD_CLOSED` as soon as another thread closes the client, `BD_TOO_MANY_FRAMES` if 4
 * frames are held. `frame` is NULL unless the result is `BD_OK`.
 */
bd_result_t bd_show_wait(const bd_show_t *show,
                         uint64_t timeout_ns,
                         bd_frame_t **frame);

/**
 * Does the same as `bd_show_wait`, but sleeps by the clock until `spin_ns` nanoseconds before the next frame is due, then looks
 * for it in a busy loop, at most until `spin_ns` after that instant. So the frame is read without a wake-up of the kernel; it
 * takes up to twice `spin_ns` in each period of one processor. 100000 is right for most machines. A reader whose processor is too
 * busy is woken as by `bd_show_wait`.
 */
bd_result_t bd_show_wait_until_due(const bd_show_t *show,
                                   uint64_t timeout_ns,
                                   uint64_t spin_ns,
                                   bd_frame_t **frame);

/**
 * Returns the number of frames that this reader has lost, over all runs; 0 for NULL and for a
 * closed client. Lost frames were published between
 * the first and the last frame that the reader has read, but it did not receive them.
 */
uint64_t bd_show_lost(const bd_show_t *show);

/**
 * Returns the header of a frame; NULL for NULL. Valid until the frame is released.
 */
const bd_frame_header_t *bd_frame_header(const bd_frame_t *frame);

/**
 * Returns the array of a frame's handles, dragon after dragon and head first, and its length in `count`: the
 * number of benches plus that of dragons. `count` may be NULL. For NULL it returns NULL and a length of 0. Valid until
 * the frame is released.
 */
const bd_handle_state_t *bd_frame_handles(const bd_frame_t *frame,
                                          size_t *count);

/**
 * Releases a frame. Its header and handles must not be read any more. NULL has no effect.
 */
void bd_frame_release(bd_frame_t *frame);

/**
 * Computes bench `index` of a frame from its two handles. Index 0 is the head of the leading dragon. Benches are numbered on from
 * dragon to dragon: those of `dragons[i]` of the header begin at its `first_handle` - i.
 *
 * `BD_INVALID_ARGUMENT` if `index` is not under the number of benches, or a pointer is NULL.
 */
bd_result_t bd_frame_bench(const bd_frame_t *frame,
                           size_t index,
                           bd_bench_state_t *bench);

/**
 * Returns a frame's relation to the previously received one in `continuity`, and the number of frames lost between the
 * two in `lost`. `lost` may be NULL.
 *
 * `BD_INVALID_ARGUMENT` if `frame` or `continuity` is NULL.
 */
bd_result_t bd_frame_continuity(const bd_frame_t *frame,
                                bd_continuity_t *continuity,
                                uint64_t *lost);

/**
 * Returns the latest description in `description`. Waits for the first one at most `timeout_ns` nanoseconds: a server
 * sends it to new readers within a tenth of a second. Later calls return the same description until a new one is
 * published.
 *
 * The description is a copy that the caller releases with `bd_description_release`. Compare its run with that of the
 * frames: after a restart, frames may arrive shortly before their description.
 *
 * `BD_NOTHING` if none arrived in time, `BD_NO_SERVER` if there is no server.
 */
bd_result_t bd_show_description(const bd_show_t *show,
                                uint64_t timeout_ns,
                                bd_description_t **description);

/**
 * Returns the run of a description; 0 for NULL.
 */
uint64_t bd_description_run_id(const bd_description_t *description);

/**
 * Returns the complete configuration as TOML, in UTF-8 with a terminating zero; NULL for NULL. Valid until the
 * description is released.
 */
const char *bd_description_toml(const bd_description_t *description);

/**
 * Returns the name of dragon `index` of a description, in UTF-8 with a terminating zero. Its poses are those of `dragons[index]` of
 * the header of the run's frames. NULL for NULL, from the number of dragons on, and for a show of one dragon, which has no name.
 * Valid until the description is released.
 */
const char *bd_description_dragon(const bd_description_t *description,
                                  size_t index);

/**
 * Releases a description. NULL has no effect.
 */
void bd_description_release(bd_description_t *description);

/**
 * Returns the latest status in `status`. Waits for the first one at most `timeout_ns` nanoseconds. The last status of a
 * server that has ended or was killed is returned until another server publishes its own.
 *
 * `BD_NOTHING` if none arrived in time, `BD_NO_SERVER` if there is no server. On error `status` is unchanged.
 */
bd_result_t bd_show_status(const bd_show_t *show,
                           uint64_t timeout_ns,
                           bd_status_t *status);

/**
 * Returns the oldest unread alert in `alert`. Waits for one at most `timeout_ns` nanoseconds; 0 does not wait. A signal
 * ends the wait early.
 *
 * Alerts are received from the first call on, so call it once with a timeout of 0 directly after `bd_show_open`.
 * Monitors send alerts; without a running monitor there are none.
 *
 * `BD_NOTHING` if no alert arrived in time. `BD_NO_SERVER` if the first call found no server. On error `alert` is
 * unchanged.
 */
bd_result_t bd_show_alert(const bd_show_t *show,
                          uint64_t timeout_ns,
                          bd_alert_t *alert);

/**
 * Sends a command and waits for the reply at most `timeout_ns` nanoseconds. A reply takes about one tick of the server.
 * `command` is a `bd_command_t`. `value` is the speed in metres per show second, the show time in seconds or the
 * pace; other commands ignore it. `reply` may be NULL.
 *
 * `BD_REFUSED` if the server refuses the command: the reply and `bd_last_error` have the reason. `BD_NO_SERVER` if no
 * server is connected, or none replied in time. After such a timeout the server may have executed the command
 * nevertheless. `BD_INVALID_ARGUMENT` if `command` is not a `bd_command_t`.
 */
bd_result_t bd_show_command(const bd_show_t *show,
                            int32_t command,
                            double value,
                            uint64_t timeout_ns,
                            bd_reply_t *reply);

/**
 * Returns the oldest unread event of a command in `event`. Waits for one at most `timeout_ns` nanoseconds; 0 does not wait. A
 * server publishes events ten times a second.
 *
 * The first call also receives up to 128 earlier events of the run.
 *
 * `BD_NOTHING` if no event arrived in time. `BD_NO_SERVER` if the first call found no server. On error `event` is unchanged.
 */
bd_result_t bd_show_command_event(const bd_show_t *show,
                                  uint64_t timeout_ns,
                                  bd_command_event_t *event);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* BENCH_DRAGON_H */
