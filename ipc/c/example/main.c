/* Prints the position of the dragon's head in metres, frame by frame: head [INSTANCE]. Ends when the run ends. */

#include <bench_dragon.h>

#include <stdio.h>

#define SECOND_NS 1000000000ull

int main(int argc, char **argv) {
  const char *instance = argc > 1 ? argv[1] : NULL;
  bd_dragon_t *dragon;
  bd_result_t result;
  uint32_t state = BD_RUNNING;

  do {
    result = bd_dragon_open(instance, "head-printer", SECOND_NS, &dragon);
  } while (result == BD_NO_SERVER);

  while ((result == BD_OK || result == BD_NOTHING) && state != BD_ENDED) {
    bd_frame_t *frame;
    result = bd_dragon_wait(dragon, SECOND_NS, &frame);
    if (result == BD_OK) {
      const bd_frame_header_t *header = bd_frame_header(frame);
      const double *position_m = bd_frame_handles(frame, NULL)->position_m;
      printf("%.3f s: head at %.3f, %.3f\n", (double)header->sim_time_ns * 1e-9, position_m[0], position_m[1]);
      state = header->state;
      bd_frame_release(frame);
    }
  }

  if (state != BD_ENDED) {
    fprintf(stderr, "%s\n", bd_last_error());
  }
  bd_dragon_close(dragon);
  return state == BD_ENDED ? 0 : 1;
}
