/* Prints the nanoseconds from the sending of each frame until its head was read: reader INSTANCE FRAMES */
#define _POSIX_C_SOURCE 200809L
#include <bench_dragon.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

int main(int argc, char **argv) {
  bd_show_t *show;
  long frames = argc > 2 ? atol(argv[2]) : 0;
  double sum = 0.0;
  if (argc < 3 || bd_show_open(argv[1], "reader-c", 60000000000ull, &show) != BD_OK) {
    fprintf(stderr, "%s\n", bd_last_error());
    return 1;
  }
  while (frames > 0) {
    bd_frame_t *frame;
    struct timespec now;
    const bd_result_t result = bd_show_wait(show, 60000000000ull, &frame);
    if (result == BD_NOTHING) {
      continue;
    }
    if (result != BD_OK) {
      fprintf(stderr, "%s\n", bd_last_error());
      return 1;
    }
    sum += bd_frame_handles(frame, NULL)->position_m[0];
    clock_gettime(CLOCK_MONOTONIC, &now);
    printf("%lld\n", (long long)now.tv_sec * 1000000000 + now.tv_nsec - (long long)bd_frame_header(frame)->published_ns);
    bd_frame_release(frame);
    --frames;
  }
  bd_show_close(show);
  return sum == 0.0;
}
