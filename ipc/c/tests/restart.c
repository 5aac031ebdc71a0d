/* Reads the frames of one server and then of the next, and prints the run of each: restart INSTANCE. */

#include "client.h"

int main(int argc, char **argv) {
  bd_show_t *show = join(argc > 1 ? argv[1] : NULL);
  bd_continuity_t continuity = BD_FIRST;
  bd_reply_t reply;
  uint64_t run_id = 0;

  while (continuity != BD_RESTARTED) {
    bd_frame_t *frame = next_frame(show);
    EXPECT(BD_OK, bd_frame_continuity(frame, &continuity, NULL));
    run_id = bd_frame_header(frame)->run_id;
    bd_frame_release(frame);
    if (continuity == BD_FIRST) {
      EXPECT(BD_OK, bd_show_command(show, BD_COMMAND_PAUSE, 0.0, PATIENCE_NS, NULL));
      printf("%" PRIu64 "\n", run_id);
      fflush(stdout);
    }
  }
  EXPECT(BD_OK, bd_show_command(show, BD_COMMAND_PAUSE, 0.0, PATIENCE_NS, &reply));
  REQUIRE(reply.run_id == run_id);
  printf("%" PRIu64 "\n", run_id);
  bd_show_close(show);
  return 0;
}
