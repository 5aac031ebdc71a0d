/* Prints the head's front hinge in metres, frame by frame: head [INSTANCE]. Ends when the run ends. */

#include <bench_dragon.h>

#include <stdio.h>

#define SECOND_NS 1000000000ull

static void print(const bd_frame_t *frame) {
  const double *position_m = bd_frame_handles(frame, NULL)->position_m;
  const double show_time_s = (double)bd_frame_header(frame)->show_time_ns / 1e9;
  printf("%.3f s: head's front hinge at %.3f, %.3f\n", show_time_s, position_m[0], position_m[1]);
}

int main(int argc, char **argv) {
  const char *instance = argc > 1 ? argv[1] : NULL;
  bd_show_t *show;
  bd_result_t result;
  bd_source_state_t source = BD_SOURCE_PUBLISHING;

  do {
    result = bd_show_open(instance, "head-printer", SECOND_NS, &show);
  } while (result == BD_NO_SERVER);

  while ((result == BD_OK || result == BD_NOTHING) && source != BD_SOURCE_ENDED && source != BD_SOURCE_LOST) {
    bd_frame_t *frame;
    result = bd_show_wait(show, SECOND_NS, &frame);
    if (result == BD_OK) {
      print(frame);
      bd_frame_release(frame);
    } else if (result == BD_NOTHING) {
      result = bd_show_source(show, SECOND_NS, &source);
    }
  }

  if (source == BD_SOURCE_LOST) {
    fprintf(stderr, "the server was killed or has failed\n");
  } else if (source != BD_SOURCE_ENDED) {
    fprintf(stderr, "%s\n", bd_last_error());
  }
  bd_show_close(show);
  return source == BD_SOURCE_ENDED ? 0 : 1;
}
