/* Exchanges frames with itself by the C interface, as exchange.rs does by the ports in Rust.
 *
 *   exchange VALUES COUNT
 *
 * Writes to standard output for each exchange the ns of its cycle and of its slack, as two uint32_t. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include <isochrone.h>

static uint64_t now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

static void check(isochrone_status status) {
  if (status == ISOCHRONE_OK) return;
  fprintf(stderr, "exchange: %d %s\n", status, isochrone_last_error());
  exit(1);
}

int main(int argc, char **argv) {
  size_t count = argc > 1 ? strtoul(argv[1], NULL, 10) : 1, exchanges = argc > 2 ? strtoul(argv[2], NULL, 10) : 1000;
  isochrone_signal *signals = calloc(count, sizeof *signals);
  char(*names)[24] = calloc(count, sizeof *names);
  uint32_t(*ns)[2] = calloc(exchanges, sizeof *ns);
  isochrone_participant *participant;
  isochrone_publisher *publisher;
  isochrone_subscriber *subscriber;
  double *values;
  for (size_t i = 0; i < count; i++) {
    snprintf(names[i], sizeof names[i], "s%zu", i);
    signals[i].name = names[i];
  }
  check(isochrone_participant_join("bench/capi", NULL, &participant));
  check(isochrone_subscriber_open(participant, "bench/capi", NULL, 0, &subscriber));
  check(isochrone_publisher_open(participant, "bench/capi", signals, count, 0, &publisher));
  check(isochrone_publisher_loan(publisher, &values));
  for (size_t n = 0; n < exchanges; n++) {
    uint64_t begin = now_ns(), end, slack_end;
    isochrone_frame frame;
    double sum = 0;
    for (size_t i = 0; i < count; i++) values[i] = (double)(n + i);
    check(isochrone_publisher_send(publisher, NULL));
    if (n == 0) /* The layout is heard. */
      check(isochrone_subscriber_wait(subscriber, 10000000000u, &frame));
    else
      check(isochrone_subscriber_newest(subscriber, &frame));
    for (size_t i = 0; i < frame.count; i++) sum += frame.values[i];
    end = now_ns();
    check(isochrone_publisher_loan(publisher, &values));
    check(isochrone_subscriber_maintain(subscriber));
    slack_end = now_ns();
    if (sum != (double)count * (double)n + (double)count * (double)(count - 1) / 2) {
      fprintf(stderr, "exchange: wrong values\n");
      return 1;
    }
    ns[n][0] = (uint32_t)(end - begin);
    ns[n][1] = (uint32_t)(slack_end - end);
  }
  fwrite(ns, sizeof *ns, exchanges, stdout);
  isochrone_publisher_close(publisher);
  isochrone_subscriber_close(subscriber);
  isochrone_participant_leave(participant);
  free(ns);
  free(names);
  free(signals);
  return 0;
}
