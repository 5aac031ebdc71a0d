/* Sends two commands, then prints every event of the run up to the second one, one per line: command_events INSTANCE. */

#include "client.h"

int main(int argc, char **argv) {
  bd_show_t *show = join(argc > 1 ? argv[1] : NULL);
  bd_command_event_t event;

  EXPECT(BD_OK, bd_show_command(show, BD_COMMAND_SPEED, 0.75, PATIENCE_NS, NULL));
  EXPECT(BD_REFUSED, bd_show_command(show, BD_COMMAND_RELEASE, 0.0, PATIENCE_NS, NULL));
  do {
    EXPECT(BD_OK, bd_show_command_event(show, PATIENCE_NS, &event));
    printf("%" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRIx64 " %" PRIx64 " %" PRIu64 " ", event.run_id, event.number, event.tick,
           (uint64_t)event.show_time_ns, (uint64_t)event.wall_ns, event.overruns);
    printf("%" PRIx64 " %" PRIx64 " %" PRIx64 " %" PRIx64 " ", bits(event.values[0]), bits(event.values[1]),
           bits(event.values[2]), bits(event.values[3]));
    printf("%" PRIx64 " %" PRIx64 " ", bits(event.lowest), bits(event.highest));
    printf("%" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", event.kind, event.sender, event.pid,
           event.refusal, event.flags);
  } while (event.kind != BD_EVENT_RELEASE);
  REQUIRE(event.sender == BD_SENDER_CLIENT && event.refusal == BD_REFUSED_NOT_HELD);
  EXPECT(BD_NOTHING, bd_show_command_event(show, 0, &event));
  EXPECT(BD_INVALID_ARGUMENT, bd_show_command_event(show, 0, NULL));
  bd_show_close(show);
  return 0;
}
