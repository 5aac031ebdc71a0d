/* Seeks to SECONDS of show time and prints every alert up to the contact, one per line: alerts INSTANCE SECONDS. */

#include "client.h"

int main(int argc, char **argv) {
  const double seek_s = argc > 2 ? atof(argv[2]) : 0.0;
  bd_show_t *show = join(argc > 1 ? argv[1] : NULL);
  bd_alert_t alert;
  bd_result_t result = bd_show_alert(show, 0, &alert);

  REQUIRE(result == BD_NOTHING || result == BD_OK);
  EXPECT(BD_OK, bd_show_command(show, BD_COMMAND_SEEK, seek_s, PATIENCE_NS, NULL));
  EXPECT(BD_OK, bd_show_command(show, BD_COMMAND_RELEASE, 0.0, PATIENCE_NS, NULL));
  do {
    do {
      result = bd_show_alert(show, SECOND_NS, &alert);
    } while (result == BD_NOTHING);
    EXPECT(BD_OK, result);
    printf("%" PRIx64 " %" PRIx64 " %" PRIx64 " %" PRIx64 " ", alert.run_id, alert.tick, (uint64_t)alert.show_time_ns,
           (uint64_t)alert.forecast_ns);
    printf("%" PRIx64 " %" PRIx64 " %" PRIx64 " ", bits(alert.clearance_m), bits(alert.point_m[0]), bits(alert.point_m[1]));
    printf("%" PRIx32 " %" PRIx32 " %" PRIx32 "\n", alert.kind, alert.bench_a, alert.bench_b);
  } while (alert.kind != BD_ALERT_CONTACT);
  REQUIRE(alert.bench_a != BD_NO_BENCH && alert.forecast_ns != INT64_MIN);
  bd_show_close(show);
  return 0;
}
