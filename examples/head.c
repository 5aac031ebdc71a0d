/* Prints the head's front hinge and the centre of its board, frame by frame, until the run has ended: head [INSTANCE] */
#include <bench_dragon.h>
#include <stdio.h>
int main(int argc, char **argv) {
  bd_show_t *show; bd_frame_t *frame; bd_bench_state_t head;
  bd_source_state_t source = BD_SOURCE_PUBLISHING;
  fputs("reads the poses as soon as `bench-dragon serve` runs\n", stderr);
  bd_result_t result = bd_show_open(argc > 1 ? argv[1] : NULL, "head-printer", UINT64_MAX, &show);
  while ((result == BD_OK || result == BD_NOTHING) && source != BD_SOURCE_ENDED && source != BD_SOURCE_LOST) {
    if ((result = bd_show_wait(show, 1000000000, &frame)) == BD_OK) {
      const double *hinge = bd_frame_handles(frame, NULL)->position_m;
      bd_frame_bench(frame, 0, &head);
      printf("%.3f s: front hinge %.3f, %.3f m, centre of the board %.3f, %.3f m\n",
             bd_frame_header(frame)->show_time_ns / 1e9, hinge[0], hinge[1], head.centre_m[0], head.centre_m[1]);
      bd_frame_release(frame);
    } else if (result == BD_NOTHING) result = bd_show_source(show, 1000000000, &source);
  }
  return source == BD_SOURCE_ENDED ? 0 : (fprintf(stderr, "%s\n", bd_last_error()), 1);
}
