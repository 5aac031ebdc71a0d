/* Prints each dragon of the first frame: name, number of benches, travel, state, and the centres of its head's and its last board. */

#include "client.h"

static void print_centre(const bd_frame_t *frame, size_t bench) {
  bd_bench_state_t state;
  EXPECT(BD_OK, bd_frame_bench(frame, bench, &state));
  printf(" %" PRIx64 " %" PRIx64, bits(state.centre_m[0]), bits(state.centre_m[1]));
}

int main(int argc, char **argv) {
  bd_show_t *show = join(argc > 1 ? argv[1] : NULL);
  bd_frame_t *frame = next_frame(show);
  const bd_frame_header_t *header = bd_frame_header(frame);
  bd_description_t *description;
  uint32_t number;
  EXPECT(BD_OK, bd_show_description(show, PATIENCE_NS, &description));
  REQUIRE(bd_description_run_id(description) == header->run_id);
  for (number = 0; number < header->dragon_count; ++number) {
    const bd_dragon_motion_t *dragon = &header->dragons[number];
    const size_t first = dragon->first_handle - number;
    printf("%s %" PRIu32 " %" PRIx64 " %d", bd_description_dragon(description, number), dragon->bench_count,
           bits(dragon->travel_m), dragon->state == BD_DRAGON_STANDING);
    print_centre(frame, first);
    print_centre(frame, first + dragon->bench_count - 1);
    printf("\n");
  }
  REQUIRE(bd_description_dragon(description, header->dragon_count) == NULL);
  REQUIRE(bd_description_dragon(NULL, 0) == NULL);
  bd_description_release(description);
  bd_frame_release(frame);
  bd_show_close(show);
  return 0;
}
