/* Stops reading for longer than the bus keeps frames, and counts the lost ones: gaps INSTANCE TICKS. */

#include "client.h"

/* Waits until the server has published a tick, without reading a frame. */
static void sleep_to_tick(const bd_show_t *show, uint64_t tick) {
  bd_status_t status;
  do {
    EXPECT(BD_OK, bd_show_status(show, PATIENCE_NS, &status));
  } while (status.tick < tick);
}

int main(int argc, char **argv) {
  const uint64_t ticks = argc > 2 ? strtoull(argv[2], NULL, 10) : 0;
  bd_show_t *show = join(argc > 1 ? argv[1] : NULL);
  bd_frame_t *frame = next_frame(show);
  const uint64_t first = bd_frame_header(frame)->tick;
  uint64_t last = first, received = 1, lost = 0;

  bd_frame_release(frame);
  REQUIRE(bd_show_lost(show) == 0);
  sleep_to_tick(show, first + ticks);
  while (last < first + ticks) {
    bd_continuity_t continuity;
    uint64_t before;
    frame = next_frame(show);
    EXPECT(BD_OK, bd_frame_continuity(frame, &continuity, &before));
    REQUIRE((continuity == BD_LOST) == (before > 0));
    last = bd_frame_header(frame)->tick;
    lost += before;
    received += 1;
    bd_frame_release(frame);
  }
  REQUIRE(bd_show_lost(show) == lost);
  REQUIRE(received + lost == last - first + 1);
  printf("%" PRIu64 "\n", lost);
  bd_show_close(show);
  return 0;
}
