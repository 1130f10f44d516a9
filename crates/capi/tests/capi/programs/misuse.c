/* Wrong handles, pointers, numbers and threads are errors with sentences, and nothing else happens. */
#include <pthread.h>

#include "expect.h"

static isochrone_participant *participant;
static isochrone_publisher *publisher;
static isochrone_subscriber *subscriber;
static isochrone_client *client;
static isochrone_pace *pace;

static void null_is_an_error_and_closing_it_is_not(void) {
  isochrone_frame frame;
  isochrone_signal signal;
  double *values = (double *)8;
  const char *answer;
  EXPECT_FAILS(isochrone_participant_join(NULL, NULL, &participant), ISOCHRONE_ERROR_ARGUMENT, "name is NULL");
  EXPECT_FAILS(isochrone_participant_join("c", NULL, NULL), ISOCHRONE_ERROR_ARGUMENT, "participant is NULL");
  EXPECT_FAILS(isochrone_publisher_open(NULL, "x", NULL, 0, 0, &publisher), ISOCHRONE_ERROR_ARGUMENT,
               "the participant is NULL");
  EXPECT_FAILS(isochrone_subscriber_open(NULL, "x", NULL, 0, &subscriber), ISOCHRONE_ERROR_ARGUMENT,
               "the participant is NULL");
  EXPECT_FAILS(isochrone_client_open(NULL, "x", 0, &client), ISOCHRONE_ERROR_ARGUMENT, "the participant is NULL");
  EXPECT_FAILS(isochrone_publisher_loan(NULL, &values), ISOCHRONE_ERROR_ARGUMENT, "the publisher is NULL");
  EXPECT(values == NULL);
  EXPECT_FAILS(isochrone_publisher_send(NULL, NULL), ISOCHRONE_ERROR_ARGUMENT, "the publisher is NULL");
  EXPECT_FAILS(isochrone_subscriber_newest(NULL, &frame), ISOCHRONE_ERROR_ARGUMENT, "the subscriber is NULL");
  EXPECT_FAILS(isochrone_subscriber_next(NULL, &frame), ISOCHRONE_ERROR_ARGUMENT, "the subscriber is NULL");
  EXPECT_FAILS(isochrone_subscriber_wait(NULL, 0, &frame), ISOCHRONE_ERROR_ARGUMENT, "the subscriber is NULL");
  EXPECT_FAILS(isochrone_subscriber_maintain(NULL), ISOCHRONE_ERROR_ARGUMENT, "the subscriber is NULL");
  EXPECT_FAILS(isochrone_subscriber_signal(NULL, 0, &signal), ISOCHRONE_ERROR_ARGUMENT, "the subscriber is NULL");
  EXPECT_FAILS(isochrone_client_call(NULL, "get", NULL, &answer), ISOCHRONE_ERROR_ARGUMENT, "the client is NULL");
  EXPECT_FAILS(isochrone_pace_open(1, 0, NULL), ISOCHRONE_ERROR_ARGUMENT, "pace is NULL");
  EXPECT_FAILS(isochrone_pace_wait(NULL, NULL), ISOCHRONE_ERROR_ARGUMENT, "the pace is NULL");
  EXPECT(isochrone_participant_leave(NULL) == ISOCHRONE_OK);
  EXPECT(isochrone_publisher_close(NULL) == ISOCHRONE_OK);
  EXPECT(isochrone_subscriber_close(NULL) == ISOCHRONE_OK);
  EXPECT(isochrone_client_close(NULL) == ISOCHRONE_OK);
  EXPECT(isochrone_pace_close(NULL) == ISOCHRONE_OK);
}

static void what_cannot_be_is_refused_by_name(void) {
  const isochrone_signal typed = {"a", "lreal", NULL}, named = {"a", NULL, NULL}, unnamed = {NULL, NULL, NULL};
  const isochrone_signal twice[] = {{"a", NULL, NULL}, {"a", NULL, NULL}};
  const char *no_text = "\xff\xfe";
  publisher = (isochrone_publisher *)8;
  EXPECT_FAILS(isochrone_publisher_open(participant, "x", &typed, 1, 0, &publisher), ISOCHRONE_ERROR_ARGUMENT,
               "signal \"a\": there is no type \"lreal\"; give one of LREAL, INT, BOOL, TIME, WORD");
  EXPECT(publisher == NULL);
  EXPECT_FAILS(isochrone_publisher_open(participant, "x", NULL, 1, 0, &publisher), ISOCHRONE_ERROR_ARGUMENT,
               "signals is NULL");
  EXPECT_FAILS(isochrone_publisher_open(participant, "x", &unnamed, 1, 0, &publisher), ISOCHRONE_ERROR_ARGUMENT,
               "the name of a signal is NULL");
  EXPECT_FAILS(isochrone_publisher_open(participant, "x", twice, 2, 0, &publisher), ISOCHRONE_ERROR_SERVICE,
               "both called \"a\"");
  EXPECT_FAILS(isochrone_publisher_open(participant, "x", NULL, 0, 0, &publisher), ISOCHRONE_ERROR_SERVICE,
               "the frame has no signal");
  EXPECT_FAILS(isochrone_publisher_open(participant, "", &named, 1, 0, &publisher), ISOCHRONE_ERROR_SERVICE,
               "the service name is empty");
  EXPECT_FAILS(isochrone_publisher_open(participant, "isochrone/x", &named, 1, 0, &publisher),
               ISOCHRONE_ERROR_SERVICE, "choose another name");
  EXPECT_FAILS(isochrone_subscriber_open(participant, no_text, NULL, 0, &subscriber), ISOCHRONE_ERROR_ARGUMENT,
               "service is not UTF-8");
  EXPECT_FAILS(isochrone_pace_open(1000, 1000, &pace), ISOCHRONE_ERROR_ARGUMENT, "not less than the period");
  EXPECT_FAILS(isochrone_pace_open(0, 0, &pace), ISOCHRONE_ERROR_ARGUMENT, "not above 0 ns");
  EXPECT_FAILS(isochrone_client_open(participant, "nobody", 0, &client), ISOCHRONE_ERROR_NODE,
               "no node \"nobody\" runs here");
  EXPECT_FAILS(isochrone_participant_join("c", "/nowhere.toml", &participant), ISOCHRONE_ERROR_DOMAIN,
               "/nowhere.toml");
  EXPECT(participant == NULL);
}

static void a_service_has_one_writer(void) {
  const isochrone_signal signal = {"a", NULL, NULL};
  isochrone_publisher *second;
  EXPECT_FAILS(isochrone_publisher_open(participant, "x", &signal, 1, 0, &second), ISOCHRONE_ERROR_WRITER,
               "a service has one writer");
  EXPECT(second == NULL);
}

static void *from_another_thread(void *unused) {
  double *values;
  isochrone_frame frame;
  isochrone_pace *own;
  (void)unused;
  EXPECT_FAILS(isochrone_publisher_loan(publisher, &values), ISOCHRONE_ERROR_THREAD,
               "the publisher belongs to another thread");
  EXPECT_FAILS(isochrone_publisher_send(publisher, NULL), ISOCHRONE_ERROR_THREAD, "another thread");
  EXPECT_FAILS(isochrone_subscriber_newest(subscriber, &frame), ISOCHRONE_ERROR_THREAD, "another thread");
  EXPECT_FAILS(isochrone_pace_wait(pace, NULL), ISOCHRONE_ERROR_THREAD, "another thread");
  EXPECT_FAILS(isochrone_publisher_close(publisher), ISOCHRONE_ERROR_THREAD, "another thread");
  /* Left open: it ends with the thread. */
  EXPECT(isochrone_pace_open(1000000, 0, &own) == ISOCHRONE_OK);
  return own;
}

static int remarks = 0;

static void remark(isochrone_level level, const char *message, void *context) {
  if (level == ISOCHRONE_LEVEL_INFO && strstr(message, "publishes service \"x\"")) ++*(int *)context;
}

int main(void) {
  const isochrone_signal signal = {"a", NULL, NULL};
  isochrone_pace *closed;
  isochrone_publisher *publisher_before;
  pthread_t thread;
  void *of_thread;
  double *values;

  EXPECT(strcmp(isochrone_last_error(), "") == 0);
  EXPECT_FAILS(isochrone_log_to(NULL, NULL), ISOCHRONE_ERROR_ARGUMENT, "the sink is NULL");
  EXPECT(isochrone_log_to(remark, &remarks) == ISOCHRONE_OK);
  EXPECT_FAILS(isochrone_log_to(remark, &remarks), ISOCHRONE_ERROR_ARGUMENT, "has a log already");
  null_is_an_error_and_closing_it_is_not();
  EXPECT(isochrone_participant_join("c", NULL, &participant) == ISOCHRONE_OK);
  what_cannot_be_is_refused_by_name();
  EXPECT(isochrone_participant_join("c", NULL, &participant) == ISOCHRONE_OK);
  EXPECT(isochrone_publisher_open(participant, "x", &signal, 1, 0, &publisher) == ISOCHRONE_OK);
  EXPECT(remarks == 1);
  EXPECT(isochrone_subscriber_open(participant, "x", NULL, 0, &subscriber) == ISOCHRONE_OK);
  EXPECT(isochrone_pace_open(1000000, 0, &pace) == ISOCHRONE_OK);
  a_service_has_one_writer();

  EXPECT(pthread_create(&thread, NULL, from_another_thread, NULL) == 0);
  EXPECT(pthread_join(thread, &of_thread) == 0);
  EXPECT_FAILS(isochrone_pace_wait(of_thread, NULL), ISOCHRONE_ERROR_THREAD, "another thread");

  /* A frame is sent once. */
  EXPECT(isochrone_publisher_loan(publisher, &values) == ISOCHRONE_OK);
  values[0] = 1;
  EXPECT(isochrone_publisher_send(publisher, NULL) == ISOCHRONE_OK);
  EXPECT_FAILS(isochrone_publisher_send(publisher, NULL), ISOCHRONE_ERROR_FRAME, "call isochrone_publisher_loan");

  /* Handles of another kind, handles that were closed, and what is none. */
  EXPECT_FAILS(isochrone_pace_wait((isochrone_pace *)publisher, NULL), ISOCHRONE_ERROR_CLOSED, "none at all");
  EXPECT_FAILS(isochrone_publisher_close((isochrone_publisher *)participant), ISOCHRONE_ERROR_CLOSED, "none at all");
  EXPECT_FAILS(isochrone_participant_leave((isochrone_participant *)&thread), ISOCHRONE_ERROR_CLOSED, "none at all");
  EXPECT(isochrone_publisher_loan((isochrone_publisher *)&thread, &values) < ISOCHRONE_OK);
  publisher_before = publisher;
  closed = pace;
  EXPECT(isochrone_pace_close(pace) == ISOCHRONE_OK);
  EXPECT_FAILS(isochrone_pace_close(closed), ISOCHRONE_ERROR_CLOSED, "the pace was closed already");
  EXPECT(isochrone_publisher_close(publisher) == ISOCHRONE_OK);
  EXPECT_FAILS(isochrone_publisher_close(publisher), ISOCHRONE_ERROR_CLOSED, "the publisher was closed already");
  EXPECT(isochrone_publisher_open(participant, "x", &signal, 1, 0, &publisher) == ISOCHRONE_OK);
  EXPECT_FAILS(isochrone_publisher_loan(publisher_before, &values), ISOCHRONE_ERROR_CLOSED, "closed already");

  /* Ports outlive their participant. */
  EXPECT(isochrone_participant_leave(participant) == ISOCHRONE_OK);
  EXPECT_FAILS(isochrone_participant_leave(participant), ISOCHRONE_ERROR_CLOSED, "has left already");
  EXPECT_FAILS(isochrone_publisher_open(participant, "y", &signal, 1, 0, &publisher_before), ISOCHRONE_ERROR_CLOSED,
               "has left already");
  EXPECT(isochrone_publisher_loan(publisher, &values) == ISOCHRONE_OK);
  EXPECT(isochrone_publisher_send(publisher, NULL) == ISOCHRONE_OK);
  /* Publisher and subscriber are left open: they end with the main thread. */
  printf("done\n");
  return 0;
}
