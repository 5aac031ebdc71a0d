/* Prints the head's front hinge, frame by frame, until the show has ended: head [INSTANCE] */
#include <bench_dragon.h>
#include <stdio.h>
int main(int argc, char **argv) {
  bd_dragon_t *dragon; bd_frame_t *frame;
  bd_result_t result = bd_dragon_open(argc > 1 ? argv[1] : NULL, "head-printer", 0, &dragon);
  uint32_t state = BD_RUNNING;
  while (state != BD_ENDED && (result == BD_OK || result == BD_NOTHING)) {
    if ((result = bd_dragon_wait(dragon, 1000000000, &frame)) != BD_OK) continue;
    state = bd_frame_header(frame)->state;
    printf("%.3f, %.3f m\n", bd_frame_handles(frame, NULL)->position_m[0], bd_frame_handles(frame, NULL)->position_m[1]);
    bd_frame_release(frame);
  }
  return state == BD_ENDED ? 0 : (fprintf(stderr, "%s\n", bd_last_error()), 1);
}
