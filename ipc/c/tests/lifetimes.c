/* Lent frames do not change while they are held: lifetimes INSTANCE. Ends the server. */

#include "client.h"

#define HELD 4

typedef struct {
  bd_frame_t *frame;
  uint64_t tick;
  bd_handle_state_t head;
} note_t;

static note_t take(const bd_show_t *show) {
  note_t note;
  bd_result_t result;
  do {
    result = bd_show_wait(show, UINT64_MAX, &note.frame);
  } while (result == BD_NOTHING);
  EXPECT(BD_OK, result);
  note.tick = bd_frame_header(note.frame)->tick;
  note.head = *bd_frame_handles(note.frame, NULL);
  return note;
}

static void require_unchanged(const note_t *note) {
  REQUIRE(bd_frame_header(note->frame)->tick == note->tick);
  REQUIRE(memcmp(bd_frame_handles(note->frame, NULL), &note->head, sizeof note->head) == 0);
}

static void at_most_four_frames_are_lent(const bd_show_t *show, note_t *notes) {
  bd_frame_t *frame;
  int index;
  for (index = 0; index < HELD; ++index) {
    notes[index] = take(show);
  }
  COMPLAINS(BD_TOO_MANY_FRAMES, "4 frames are held, the most that a reader may hold: release one, or keep copies",
            bd_show_wait(show, PATIENCE_NS, &frame));
  REQUIRE(frame == NULL);
  bd_frame_release(notes[0].frame);
  notes[0] = take(show);
  REQUIRE(notes[0].tick == notes[HELD - 1].tick + 1);
}

static void the_latest_frame_is_newer_than_any_other(const bd_show_t *show, const note_t *notes) {
  bd_frame_t *frame;
  bd_result_t result;
  do {
    result = bd_show_latest(show, &frame);
  } while (result == BD_NOTHING);
  EXPECT(BD_OK, result);
  REQUIRE(bd_frame_header(frame)->tick > notes[0].tick);
  bd_frame_release(frame);
}

static void there_is_one_bench_fewer_than_handles(const bd_frame_t *frame) {
  const uint32_t count = bd_frame_header(frame)->bench_count;
  bd_bench_state_t bench;
  char text[100];
  EXPECT(BD_OK, bd_frame_bench(frame, count - 1, &bench));
  sprintf(text, "index is %u, must be under the number of benches, %u", (unsigned)count, (unsigned)count);
  COMPLAINS(BD_INVALID_ARGUMENT, text, bd_frame_bench(frame, count, &bench));
  EXPECT(BD_INVALID_ARGUMENT, bd_frame_bench(frame, SIZE_MAX, &bench));
  COMPLAINS(BD_INVALID_ARGUMENT, "bench is NULL, must not be", bd_frame_bench(frame, 0, NULL));
}

static void the_caller_owns_the_description(const bd_show_t *show, uint64_t run_id) {
  bd_description_t *first, *second;
  bd_status_t status;
  EXPECT(BD_OK, bd_show_description(show, PATIENCE_NS, &first));
  EXPECT(BD_OK, bd_show_description(show, 0, &second));
  bd_description_release(second);
  REQUIRE(bd_description_run_id(first) == run_id);
  EXPECT(BD_OK, bd_show_status(show, PATIENCE_NS, &status));
  REQUIRE(status.run_id == run_id);
  printf("%" PRIu32 "\n%" PRIu32 "\n%s", status.pid, status.rate_hz, bd_description_toml(first));
  bd_description_release(first);
}

static void a_closed_client_is_refused(bd_show_t *show) {
  bd_frame_t *frame;
  bd_status_t status;
  bd_source_state_t state;
  COMPLAINS(BD_CLOSED, "the client is closed", bd_show_wait(show, PATIENCE_NS, &frame));
  REQUIRE(frame == NULL);
  EXPECT(BD_CLOSED, bd_show_status(show, 0, &status));
  EXPECT(BD_CLOSED, bd_show_source(show, 0, &state));
  EXPECT(BD_CLOSED, bd_show_command(show, BD_COMMAND_PAUSE, 0.0, 0, NULL));
  bd_show_close(show);
}

int main(int argc, char **argv) {
  bd_show_t *show = join(argc > 1 ? argv[1] : NULL);
  note_t notes[HELD];
  bd_frame_t *frame;
  int index;

  at_most_four_frames_are_lent(show, notes);
  there_is_one_bench_fewer_than_handles(notes[0].frame);
  for (index = 1; index < HELD - 1; ++index) {
    bd_frame_release(notes[index].frame);
  }
  the_latest_frame_is_newer_than_any_other(show, notes);
  the_caller_owns_the_description(show, bd_frame_header(notes[0].frame)->run_id);

  EXPECT(BD_OK, bd_show_command(show, BD_COMMAND_STOP, 0.0, PATIENCE_NS, NULL));
  while (bd_show_latest(show, &frame) == BD_OK) {
    bd_frame_release(frame);
  }
  require_unchanged(&notes[0]);
  require_unchanged(&notes[HELD - 1]);
  bd_frame_release(notes[HELD - 1].frame);
  bd_show_close(show);
  require_unchanged(&notes[0]);
  a_closed_client_is_refused(show);
  bd_frame_release(notes[0].frame);
  return 0;
}
