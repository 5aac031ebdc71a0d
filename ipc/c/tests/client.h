/* Shared parts of the test clients. Each is compiled as C99 and as C++17. A failing client prints the place and exits with 1. */

#ifndef CLIENT_H
#define CLIENT_H

#include <bench_dragon.h>

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SECOND_NS 1000000000u
#define PATIENCE_NS (60ull * SECOND_NS)

#define REQUIRE(condition) require((condition) ? 1 : 0, #condition, __FILE__, __LINE__)
#define EXPECT(expected, call) expect(expected, call, #call, __FILE__, __LINE__)
/* Requires that a call fails with this result and this error text. */
#define COMPLAINS(expected, text, call) (EXPECT(expected, call), complains(text, #call, __FILE__, __LINE__))

static inline void require(int holds, const char *condition, const char *file, int line) {
  if (!holds) {
    fprintf(stderr, "%s:%d: condition is false: %s; last error: %s\n", file, line, condition, bd_last_error());
    exit(1);
  }
}

static inline void expect(bd_result_t expected, bd_result_t got, const char *call, const char *file, int line) {
  if (got != expected) {
    fprintf(stderr, "%s:%d: %s returns %d, must be %d: %s\n", file, line, call, (int)got, (int)expected, bd_last_error());
    exit(1);
  }
}

static inline void complains(const char *text, const char *call, const char *file, int line) {
  if (strcmp(bd_last_error(), text) != 0) {
    fprintf(stderr, "%s:%d: %s: error text is \"%s\", must be \"%s\"\n", file, line, call, bd_last_error(), text);
    exit(1);
  }
}

static inline bd_show_t *join(const char *instance) {
  bd_show_t *show;
  EXPECT(BD_OK, bd_show_open(instance, "c-test", PATIENCE_NS, &show));
  REQUIRE(show != NULL);
  return show;
}

/* Returns the next frame. Waits without a limit. */
static inline bd_frame_t *next_frame(const bd_show_t *show) {
  bd_frame_t *frame;
  bd_result_t result;
  do {
    result = bd_show_wait(show, SECOND_NS, &frame);
    REQUIRE((result == BD_OK) == (frame != NULL));
  } while (result == BD_NOTHING);
  EXPECT(BD_OK, result);
  return frame;
}

/* Returns the header of the frame at a tick, which must be unread. */
static inline bd_frame_header_t header_at(const bd_show_t *show, uint64_t tick) {
  bd_frame_header_t header;
  do {
    bd_frame_t *frame = next_frame(show);
    header = *bd_frame_header(frame);
    bd_frame_release(frame);
  } while (header.tick < tick);
  REQUIRE(header.tick == tick);
  return header;
}

/* Returns the bits of a number, so that it is printed without rounding. */
static inline uint64_t bits(double number) {
  uint64_t word;
  memcpy(&word, &number, sizeof word);
  return word;
}

#endif
