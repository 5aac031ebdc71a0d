// Prints the centre in metres and the heading in radians of every bench of one frame, in C++17: benches [INSTANCE].

#include <bench_dragon.h>

#include <cstdio>
#include <memory>
#include <stdexcept>

namespace {

struct Release {
  void operator()(bd_show_t *show) const { bd_show_close(show); }
  void operator()(bd_frame_t *frame) const { bd_frame_release(frame); }
};
using Show = std::unique_ptr<bd_show_t, Release>;
using Frame = std::unique_ptr<bd_frame_t, Release>;

// Returns true for BD_OK and false for BD_NOTHING. Throws the error text for every other result.
bool check(bd_result_t result) {
  if (result != BD_OK && result != BD_NOTHING) {
    throw std::runtime_error(bd_last_error());
  }
  return result == BD_OK;
}

Show open(const char *instance) {
  bd_show_t *show;
  check(bd_show_open(instance, "bench-printer", 0, &show));
  return Show(show);
}

Frame next(const Show &show) {
  constexpr std::uint64_t second_ns = 1'000'000'000;
  bd_frame_t *frame;
  while (!check(bd_show_wait(show.get(), second_ns, &frame))) {
  }
  return Frame(frame);
}

}  // namespace

int main(int argc, char **argv) try {
  const Show show = open(argc > 1 ? argv[1] : nullptr);
  const Frame frame = next(show);
  for (std::uint32_t index = 0; index < bd_frame_header(frame.get())->bench_count; ++index) {
    bd_bench_state_t bench;
    check(bd_frame_bench(frame.get(), index, &bench));
    std::printf("%u: centre %.3f, %.3f, heading %.3f\n", index, bench.centre_m[0], bench.centre_m[1], bench.heading_rad);
  }
  return 0;
} catch (const std::exception &error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
