/* Writes every value of every frame to FILE until the run ends, one frame per line: frames INSTANCE FILE.
 * Prints "reading" after the first frame. */

#include "client.h"

static void print_word(FILE *file, uint64_t word) { fprintf(file, "%" PRIx64 " ", word); }

static void print_numbers(FILE *file, const double *numbers, size_t count) {
  size_t index;
  for (index = 0; index < count; ++index) {
    print_word(file, bits(numbers[index]));
  }
}

static void print_header(FILE *file, const bd_frame_header_t *header) {
  print_word(file, header->run_id);
  print_word(file, header->tick);
  print_word(file, (uint64_t)header->show_time_ns);
  print_word(file, header->scheduled_ns);
  print_word(file, header->published_ns);
  print_numbers(file, &header->head_travel_m, 1);
  print_numbers(file, &header->head_speed_mps, 1);
  print_numbers(file, &header->time_scale, 1);
  print_word(file, header->bench_count);
  print_word(file, header->state);
}

static void print_frame(FILE *file, const bd_frame_t *frame) {
  const bd_frame_header_t *header = bd_frame_header(frame);
  const bd_handle_state_t *handles;
  bd_bench_state_t bench;
  bd_continuity_t continuity;
  uint64_t lost;
  size_t count, index;

  print_header(file, header);
  handles = bd_frame_handles(frame, &count);
  REQUIRE(count == (size_t)header->bench_count + header->dragon_count);
  for (index = 0; index < count; ++index) {
    print_numbers(file, handles[index].position_m, 3);
    print_numbers(file, handles[index].velocity_mps, 3);
  }
  for (index = 0; index < header->bench_count; ++index) {
    EXPECT(BD_OK, bd_frame_bench(frame, index, &bench));
    print_numbers(file, bench.centre_m, 3);
    print_numbers(file, &bench.heading_rad, 1);
    print_numbers(file, bench.velocity_mps, 3);
    print_numbers(file, &bench.turn_rate_radps, 1);
    print_numbers(file, &bench.pitch_rad, 1);
  }
  EXPECT(BD_OK, bd_frame_continuity(frame, &continuity, &lost));
  fprintf(file, "%d %" PRIu64 "\n", (int)continuity, lost);
}

int main(int argc, char **argv) {
  bd_show_t *show = join(argc > 1 ? argv[1] : NULL);
  FILE *file = fopen(argc > 2 ? argv[2] : "frames", "w");
  uint32_t state;
  int begun = 0;
  REQUIRE(file != NULL);
  do {
    bd_frame_t *frame = next_frame(show);
    print_frame(file, frame);
    state = bd_frame_header(frame)->state;
    if (begun == 0) {
      begun = 1;
      printf("reading\n");
      fflush(stdout);
    }
    bd_frame_release(frame);
  } while (state != BD_ENDED);
  REQUIRE(bd_show_lost(show) == 0);
  bd_show_close(show);
  REQUIRE(fclose(file) == 0);
  return 0;
}
