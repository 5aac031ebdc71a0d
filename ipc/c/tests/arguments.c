/* NULL and out-of-range arguments return an error and do no harm: arguments INSTANCE, on which no server runs. */

#include "client.h"

static const char *const MISSING = "show is NULL, must not be";

static void null_is_refused_as_a_client(void) {
  bd_show_t *const none = NULL;
  bd_frame_t *frame = (bd_frame_t *)&frame;
  bd_description_t *description = (bd_description_t *)&description;
  bd_status_t status;
  bd_alert_t alert;

  COMPLAINS(BD_INVALID_ARGUMENT, MISSING, bd_show_next(none, &frame));
  REQUIRE(frame == NULL);
  COMPLAINS(BD_INVALID_ARGUMENT, MISSING, bd_show_latest(none, &frame));
  COMPLAINS(BD_INVALID_ARGUMENT, MISSING, bd_show_wait(none, 0, &frame));
  COMPLAINS(BD_INVALID_ARGUMENT, MISSING, bd_show_wait_until_due(none, 0, 100000, &frame));
  COMPLAINS(BD_INVALID_ARGUMENT, MISSING, bd_show_description(none, 0, &description));
  REQUIRE(description == NULL);
  COMPLAINS(BD_INVALID_ARGUMENT, MISSING, bd_show_status(none, 0, &status));
  COMPLAINS(BD_INVALID_ARGUMENT, MISSING, bd_show_alert(none, 0, &alert));
  COMPLAINS(BD_INVALID_ARGUMENT, MISSING, bd_show_command(none, BD_COMMAND_PAUSE, 0.0, 0, NULL));
  REQUIRE(bd_show_lost(none) == 0);
  bd_show_close(none);
}

static void null_is_refused_as_a_frame(void) {
  bd_frame_t *const none = NULL;
  bd_bench_state_t bench;
  bd_continuity_t continuity;
  size_t count = 1;

  REQUIRE(bd_frame_header(none) == NULL);
  REQUIRE(bd_frame_handles(none, &count) == NULL && count == 0);
  COMPLAINS(BD_INVALID_ARGUMENT, "frame is NULL, must not be", bd_frame_bench(none, 0, &bench));
  COMPLAINS(BD_INVALID_ARGUMENT, "frame is NULL, must not be", bd_frame_continuity(none, &continuity, NULL));
  bd_frame_release(none);
}

static void null_is_harmless_as_a_description(void) {
  REQUIRE(bd_description_run_id(NULL) == 0);
  REQUIRE(bd_description_toml(NULL) == NULL);
  bd_description_release(NULL);
}

static void bad_names_are_refused(const char *instance) {
  bd_show_t *show = (bd_show_t *)&show;
  char long_name[130];

  COMPLAINS(BD_INVALID_ARGUMENT, "instance is \"No Dragon\", must be 1 to 24 of a-z, 0-9 and -",
            bd_show_open("No Dragon", "c-test", 0, &show));
  REQUIRE(show == NULL);
  COMPLAINS(BD_INVALID_ARGUMENT, "instance is \"\\xff\", must be UTF-8", bd_show_open("\xff", "c-test", 0, &show));
  COMPLAINS(BD_INVALID_ARGUMENT, "name is NULL, must not be", bd_show_open(instance, NULL, 0, &show));
  COMPLAINS(BD_INVALID_ARGUMENT, "name is \"\", must be 1 to 128 printable ASCII characters",
            bd_show_open(instance, "", 0, &show));
  memset(long_name, 'a', sizeof long_name - 1);
  long_name[sizeof long_name - 1] = '\0';
  EXPECT(BD_INVALID_ARGUMENT, bd_show_open(instance, long_name, 0, &show));
  COMPLAINS(BD_INVALID_ARGUMENT, "show is NULL, must not be", bd_show_open(instance, "c-test", 0, NULL));
}

static void a_missing_server_is_reported(const char *instance) {
  bd_show_t *show;
  char text[300];
  sprintf(text, "no server runs on instance \"%.24s\": start the show, or by hand `bench-dragon serve --config FILE --held "
          "--instance %.24s`", instance, instance);
  COMPLAINS(BD_NO_SERVER, text, bd_show_open(instance, "c-test", 0, &show));
  REQUIRE(show == NULL);
  COMPLAINS(BD_NO_SERVER, text, bd_show_open(instance, "c-test", 30 * 1000 * 1000, &show));
}

int main(int argc, char **argv) {
  const char *instance = argc > 1 ? argv[1] : "dragon";
  REQUIRE(strcmp(bd_last_error(), "") == 0);
  null_is_refused_as_a_client();
  null_is_refused_as_a_frame();
  null_is_harmless_as_a_description();
  bad_names_are_refused(instance);
  a_missing_server_is_reported(instance);
  printf("%s\n", bd_version());
  return 0;
}
