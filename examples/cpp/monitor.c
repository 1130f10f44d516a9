/* Prints frames of a service with names, units, age and flags, then asks a node for the values of some signals.
 *
 *   monitor [SERVICE [FRAMES [NODE SIGNAL]]]
 *
 * Defaults: plant/valve, 5 frames, no question. Exit status: 0 done, 1 an error, 3 no frame came for five seconds. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include <isochrone.h>

#define S 1000000000ull

static int failed(const char *what) {
  fprintf(stderr, "%s: %s\n", what, isochrone_last_error());
  return 1;
}

static int ask(isochrone_participant *participant, const char *node, const char *signal) {
  isochrone_client *client;
  const char *answer;
  char params[300];
  isochrone_status status;
  if (isochrone_client_open(participant, node, 5 * S, &client) != ISOCHRONE_OK) return failed(node);
  snprintf(params, sizeof params, "{\"names\": [\"%s\"]}", signal);
  status = isochrone_client_call(client, "get", params, &answer);
  /* The answer belongs to the client. */
  if (answer) printf("%s\n", answer);
  isochrone_client_close(client);
  return status == ISOCHRONE_OK ? 0 : failed(signal);
}

int main(int argc, char **argv) {
  const char *service = argc > 1 ? argv[1] : "plant/valve";
  int left = argc > 2 ? atoi(argv[2]) : 5;
  isochrone_participant *participant;
  isochrone_subscriber *subscriber;
  int result = 0;

  if (isochrone_participant_join("monitor", NULL, &participant) != ISOCHRONE_OK) return failed("cannot join");
  if (isochrone_subscriber_open(participant, service, NULL, 0, &subscriber) != ISOCHRONE_OK) return failed(service);
  for (; left > 0 && result == 0; left--) {
    isochrone_frame frame;
    isochrone_status status = isochrone_subscriber_wait(subscriber, 5 * S, &frame);
    if (status == ISOCHRONE_NOTHING) {
      fprintf(stderr, "no frames on %s\n", service);
      result = 3;
    } else if (status != ISOCHRONE_OK) {
      result = failed(service);
    } else {
      printf("%" PRIu64 ":", frame.sequence);
      for (size_t i = 0; i < frame.count; i++) {
        isochrone_signal signal = {"?", "", ""};
        isochrone_subscriber_signal(subscriber, i, &signal);
        printf(" %s = %g %s", signal.name, frame.values[i], signal.unit);
      }
      printf(" (%.3f ms old, flags %" PRIx64 ")\n", (double)(isochrone_now_ns() - frame.sampled_ns) / 1e6, frame.flags);
    }
  }
  if (result == 0 && argc > 4) result = ask(participant, argv[3], argv[4]);
  isochrone_subscriber_close(subscriber);
  isochrone_participant_leave(participant);
  return result;
}
