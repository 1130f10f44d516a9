/* What is published is what is read: values, names, stamps, ages, losses. */
#include "expect.h"

#define MS 1000000ull

static isochrone_publisher *open_publisher(isochrone_participant *participant, const isochrone_signal *signals,
                                           size_t count) {
  isochrone_publisher *publisher = NULL;
  EXPECT(isochrone_publisher_open(participant, "plant/c", signals, count, 5 * MS, &publisher) == ISOCHRONE_OK);
  return publisher;
}

static void publish(isochrone_publisher *publisher, double first, double second, const isochrone_stamp *stamp) {
  double *values = NULL;
  EXPECT(isochrone_publisher_loan(publisher, &values) == ISOCHRONE_OK);
  values[0] = first;
  values[1] = second;
  EXPECT(isochrone_publisher_send(publisher, stamp) == ISOCHRONE_OK);
}

int main(void) {
  const isochrone_signal signals[] = {{"level", NULL, "m"}, {"full", "BOOL", NULL}};
  const isochrone_signal turned[] = {{"full", "BOOL", NULL}, {"level", NULL, "m"}};
  const isochrone_signal others[] = {{"a", NULL, NULL}, {"b", NULL, NULL}};
  const char *names[] = {"level"};
  const isochrone_stamp stamp = {7, 5, 3, 2, ISOCHRONE_STALE | ISOCHRONE_FORCED};
  isochrone_participant *participant = NULL;
  isochrone_publisher *publisher = NULL;
  isochrone_subscriber *all = NULL, *level = NULL;
  isochrone_frame frame;
  isochrone_signal signal;
  uint64_t before;
  int n;

  EXPECT(isochrone_participant_join("c/frames", NULL, &participant) == ISOCHRONE_OK);
  EXPECT(isochrone_subscriber_open(participant, "plant/c", NULL, 0, &all) == ISOCHRONE_OK);
  EXPECT(isochrone_subscriber_open(participant, "plant/c", names, 1, &level) == ISOCHRONE_OK);
  EXPECT(isochrone_subscriber_newest(all, &frame) == ISOCHRONE_NOTHING);
  EXPECT(isochrone_subscriber_wait(all, MS, &frame) == ISOCHRONE_NOTHING);
  EXPECT(isochrone_subscriber_signal(all, 0, &signal) == ISOCHRONE_ERROR_SIGNAL);

  publisher = open_publisher(participant, signals, 2);
  before = isochrone_now_ns();
  publish(publisher, 1.5, 1, &stamp);
  EXPECT(isochrone_subscriber_wait(all, 60000 * MS, &frame) == ISOCHRONE_OK);
  EXPECT(frame.count == 2 && frame.values[0] == 1.5 && frame.values[1] == 1);
  EXPECT(frame.cycle == 7 && frame.release_ns == 5 && frame.source_ns == 3 && frame.missed == 2);
  EXPECT(frame.flags == (ISOCHRONE_STALE | ISOCHRONE_FORCED));
  EXPECT(isochrone_flags_handed_on(frame.flags) == (ISOCHRONE_UPSTREAM | ISOCHRONE_FORCED));
  EXPECT(frame.sequence == 0 && frame.lost == 0 && frame.restarts == 0);
  EXPECT(before <= frame.publish_ns && frame.publish_ns <= frame.received_ns);
  EXPECT(frame.sampled_ns == frame.publish_ns && frame.received_ns <= isochrone_now_ns());
  EXPECT(isochrone_subscriber_signal(all, 0, &signal) == ISOCHRONE_OK);
  EXPECT(strcmp(signal.name, "level") == 0 && strcmp(signal.type, "LREAL") == 0 && strcmp(signal.unit, "m") == 0);
  EXPECT(isochrone_subscriber_signal(all, 1, &signal) == ISOCHRONE_OK);
  EXPECT(strcmp(signal.name, "full") == 0 && strcmp(signal.type, "BOOL") == 0 && strcmp(signal.unit, "") == 0);
  EXPECT_FAILS(isochrone_subscriber_signal(all, 2, &signal), ISOCHRONE_ERROR_SIGNAL, "index 2");

  /* All in their order, or the newest alone. */
  for (n = 1; n <= 3; n++) publish(publisher, n, 0, NULL);
  for (n = 1; n <= 3; n++) {
    EXPECT(isochrone_subscriber_next(all, &frame) == ISOCHRONE_OK);
    EXPECT(frame.values[0] == n && frame.sequence == (uint64_t)n && frame.flags == 0);
  }
  EXPECT(isochrone_subscriber_next(all, &frame) == ISOCHRONE_NOTHING);
  EXPECT(isochrone_subscriber_wait(level, 60000 * MS, &frame) == ISOCHRONE_OK);
  EXPECT(isochrone_subscriber_newest(level, &frame) == ISOCHRONE_OK);
  EXPECT(frame.count == 1 && frame.values[0] == 3 && frame.sequence == 3 && frame.lost == 0);
  EXPECT(isochrone_subscriber_newest(level, &frame) == ISOCHRONE_NOTHING);

  /* More than wait are lost, and told. */
  for (n = 0; n < 300; n++) publish(publisher, n, 0, NULL);
  EXPECT(isochrone_subscriber_next(all, &frame) == ISOCHRONE_OK);
  EXPECT(frame.lost > 0 && frame.values[0] == (double)frame.lost);
  EXPECT(isochrone_subscriber_newest(level, &frame) == ISOCHRONE_OK);
  EXPECT(frame.values[0] == 299);

  /* A publisher that starts again with other signals: the name is found at its new place, or missed by name. */
  EXPECT(isochrone_publisher_close(publisher) == ISOCHRONE_OK);
  publisher = open_publisher(participant, turned, 2);
  publish(publisher, 1, 2.5, NULL);
  EXPECT(isochrone_subscriber_wait(level, 60000 * MS, &frame) == ISOCHRONE_OK);
  EXPECT(frame.count == 1 && frame.values[0] == 2.5 && frame.restarts == 1);
  EXPECT(isochrone_publisher_close(publisher) == ISOCHRONE_OK);
  publisher = open_publisher(participant, others, 2);
  publish(publisher, 4, 5, NULL);
  EXPECT_FAILS(isochrone_subscriber_wait(level, 60000 * MS, &frame), ISOCHRONE_ERROR_SIGNAL,
               "its frames have no signal \"level\"; there is: a, b");
  EXPECT(frame.values == NULL && frame.count == 0 && frame.publish_ns > 0);
  EXPECT_FAILS(isochrone_subscriber_signal(level, 0, &signal), ISOCHRONE_ERROR_SIGNAL, "index 0");

  EXPECT(isochrone_subscriber_close(all) == ISOCHRONE_OK);
  EXPECT(isochrone_subscriber_close(level) == ISOCHRONE_OK);
  EXPECT(isochrone_publisher_close(publisher) == ISOCHRONE_OK);
  EXPECT(isochrone_participant_leave(participant) == ISOCHRONE_OK);
  printf("done\n");
  return 0;
}
