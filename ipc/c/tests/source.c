/* Reports how a server ended: source INSTANCE. Prints "reading" at the first frame, and the state of the source as soon as it no
 * longer publishes. Then sends a command, and prints its result. */

#include "client.h"

#define LIMIT_NS (SECOND_NS / 2)

int main(int argc, char **argv) {
  static const char *const NAMES[] = {"publishing", "hanging", "ended", "lost"};
  bd_show_t *show = join(argc > 1 ? argv[1] : NULL);
  bd_source_state_t state = BD_SOURCE_PUBLISHING;
  bd_status_t status;

  bd_frame_release(next_frame(show));
  EXPECT(BD_OK, bd_show_status(show, PATIENCE_NS, &status));
  puts("reading");
  fflush(stdout);
  while (state == BD_SOURCE_PUBLISHING) {
    bd_frame_t *frame;
    const bd_result_t result = bd_show_wait(show, LIMIT_NS, &frame);
    if (result == BD_OK) {
      bd_frame_release(frame);
    } else {
      EXPECT(BD_NOTHING, result);
      EXPECT(BD_OK, bd_show_source(show, LIMIT_NS, &state));
    }
  }
  puts(NAMES[state]);
  EXPECT(BD_OK, bd_show_status(show, PATIENCE_NS, &status));
  if (state != BD_SOURCE_HANGING) {
    EXPECT(BD_NO_SERVER, bd_show_command(show, BD_COMMAND_PAUSE, 0.0, UINT64_MAX, NULL));
  }
  bd_show_close(show);
  return 0;
}
