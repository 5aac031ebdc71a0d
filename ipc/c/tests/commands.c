/* Checks every command, its reply and the frame from which it holds: commands INSTANCE. Ends the server. */

#include "client.h"

static bd_reply_t reply;

static void accept(const bd_show_t *show, bd_command_t command, double value) {
  EXPECT(BD_OK, bd_show_command(show, (int32_t)command, value, PATIENCE_NS, &reply));
  REQUIRE(reply.refusal == BD_ACCEPTED);
}

static void refuse(const bd_show_t *show, bd_command_t command, double value, bd_refusal_t refusal, const char *text) {
  COMPLAINS(BD_REFUSED, text, bd_show_command(show, (int32_t)command, value, PATIENCE_NS, &reply));
  REQUIRE(reply.refusal == (uint32_t)refusal);
}

/* Returns the header of the frame at the tick of the last reply. */
static bd_frame_header_t header_then(const bd_show_t *show) {
  const bd_frame_header_t header = header_at(show, reply.tick);
  REQUIRE(header.run_id == reply.run_id);
  return header;
}

int main(int argc, char **argv) {
  bd_show_t *show = join(argc > 1 ? argv[1] : NULL);
  bd_frame_header_t header;

  accept(show, BD_COMMAND_PAUSE, 0.0);
  header = header_then(show);
  REQUIRE(header.state == BD_PAUSED && header.head_speed_mps == 0.0);
  accept(show, BD_COMMAND_RESUME, 0.0);
  REQUIRE(header_then(show).state == BD_RUNNING);

  accept(show, BD_COMMAND_SPEED, 0.5);
  REQUIRE(header_then(show).head_speed_mps == 0.5);
  refuse(show, BD_COMMAND_SPEED, 10.5, BD_REFUSED_OUT_OF_RANGE, "the speed is 10.5 m/s, must be from 0 to 10 m/s");
  REQUIRE(reply.lowest == 0.0 && reply.highest == 10.0);
  refuse(show, BD_COMMAND_SPEED, (double)NAN, BD_REFUSED_OUT_OF_RANGE, "the speed is NaN m/s, must be from 0 to 10 m/s");
  REQUIRE(header_then(show).head_speed_mps == 0.5);

  accept(show, BD_COMMAND_SEEK, 100.0);
  header = header_then(show);
  REQUIRE(header.show_time_ns == 100 * (int64_t)SECOND_NS && header.head_travel_m == 100.0);

  refuse(show, BD_COMMAND_RELEASE, 0.0, BD_REFUSED_NOT_HELD, "the show is not held");
  accept(show, BD_COMMAND_HOLD, 0.0);
  REQUIRE(header_then(show).state == BD_HELD);
  refuse(show, BD_COMMAND_RESUME, 0.0, BD_REFUSED_HELD, "the show is held: release it first");
  accept(show, BD_COMMAND_RELEASE, 0.0);
  REQUIRE(header_then(show).state == BD_RUNNING);

  COMPLAINS(BD_INVALID_ARGUMENT, "command is 7, must be a bd_command_t", bd_show_command(show, 7, 0.0, PATIENCE_NS, &reply));
  COMPLAINS(BD_INVALID_ARGUMENT, "command is -1, must be a bd_command_t", bd_show_command(show, -1, 0.0, PATIENCE_NS, NULL));

  EXPECT(BD_OK, bd_show_command(show, BD_COMMAND_STOP, 0.0, PATIENCE_NS, NULL));
  bd_show_close(show);
  return 0;
}
