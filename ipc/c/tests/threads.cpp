// Several threads use one client: threads INSTANCE. Ends the server.

#include "client.h"

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>

namespace {

struct Release {
  void operator()(bd_show_t *show) const { bd_show_close(show); }
  void operator()(bd_frame_t *frame) const { bd_frame_release(frame); }
};
using Show = std::unique_ptr<bd_show_t, Release>;
using Frame = std::unique_ptr<bd_frame_t, Release>;

// Queue of at most one frame, from the thread that reads frames to the thread that checks them. Each thread holds one more, so
// at most three frames are held.
class Passage {
 public:
  void put(Frame frame) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !frame_; });
    frame_ = std::move(frame);
    changed_.notify_all();
  }

  Frame take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return frame_ != nullptr; });
    changed_.notify_all();
    return std::move(frame_);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  Frame frame_;
};

constexpr std::uint64_t FRAMES = 60;

void read(const bd_show_t *show, Passage &passage) {
  for (std::uint64_t count = 0; count < FRAMES; ++count) {
    passage.put(Frame(next_frame(show)));
  }
  // No call has failed in this thread; failures of other threads do not appear here.
  REQUIRE(strcmp(bd_last_error(), "") == 0);
}

void look(Passage &passage) {
  std::uint64_t expected = 0;
  for (std::uint64_t count = 0; count < FRAMES; ++count) {
    const Frame frame = passage.take();
    const std::uint64_t tick = bd_frame_header(frame.get())->tick;
    REQUIRE(count == 0 || tick == expected);
    expected = tick + 1;
  }
}

void command(const bd_show_t *show, const std::atomic<bool> &done) {
  while (!done) {
    EXPECT(BD_OK, bd_show_command(show, BD_COMMAND_PAUSE, 0.0, PATIENCE_NS, nullptr));
    EXPECT(BD_OK, bd_show_command(show, BD_COMMAND_RESUME, 0.0, PATIENCE_NS, nullptr));
    COMPLAINS(BD_INVALID_ARGUMENT, "command is 99, must be a bd_command_t", bd_show_command(show, 99, 0.0, 0, nullptr));
    bd_status_t status;
    EXPECT(BD_OK, bd_show_status(show, PATIENCE_NS, &status));
  }
}

}  // namespace

int main(int argc, char **argv) {
  Show show(join(argc > 1 ? argv[1] : nullptr));
  Passage passage;
  std::atomic<bool> done{false};
  std::thread reader(read, show.get(), std::ref(passage));
  std::thread looker(look, std::ref(passage));
  std::thread commander(command, show.get(), std::cref(done));
  std::thread second_commander(command, show.get(), std::cref(done));
  reader.join();
  looker.join();
  done = true;
  commander.join();
  second_commander.join();
  REQUIRE(bd_show_lost(show.get()) == 0);

  // By the clock, each frame follows the one before.
  for (std::uint64_t read = 0, before = 0; read < 100;) {
    bd_frame_t *frame;
    const bd_result_t result = bd_show_wait_until_due(show.get(), PATIENCE_NS, 100000, &frame);
    if (result == BD_NOTHING) continue;
    EXPECT(BD_OK, result);
    const std::uint64_t tick = bd_frame_header(frame)->tick;
    REQUIRE(read++ == 0 || tick == before + 1);
    before = tick;
    bd_frame_release(frame);
  }

  Frame last(next_frame(show.get()));
  const std::uint64_t tick = bd_frame_header(last.get())->tick;
  EXPECT(BD_OK, bd_show_command(show.get(), BD_COMMAND_STOP, 0.0, PATIENCE_NS, nullptr));
  // Closing ends the wait of another thread. Frames still arrive until the server has ended.
  std::thread waiting([handle = show.get()] {
    bd_result_t result;
    do {
      bd_frame_t *frame;
      result = bd_show_wait(handle, UINT64_MAX, &frame);
      bd_frame_release(frame);
    } while (result == BD_OK || result == BD_NOTHING);
    COMPLAINS(BD_CLOSED, bd_last_error(), result);
  });
  std::thread([&show] { show.reset(); }).join();
  waiting.join();
  std::thread([&last, tick] {
    REQUIRE(bd_frame_header(last.get())->tick == tick);
    last.reset();
  }).join();
  return 0;
}
