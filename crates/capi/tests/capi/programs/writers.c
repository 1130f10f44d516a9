/* A service that somebody writes is refused, and taken over only where that is asked for and possible. */
#include "expect.h"

int main(int count, char **arguments) {
  const isochrone_signal signal = {"a", NULL, NULL};
  isochrone_participant *participant;
  isochrone_publisher *publisher, *second;
  EXPECT(count == 4);
  EXPECT(isochrone_participant_join("c/writers", NULL, &participant) == ISOCHRONE_OK);

  /* A link brings it from another machine: that cannot be taken over. */
  const char *far = arguments[1];
  const char *is_far = "is written on another machine already, whose frames arrive through";
  EXPECT_FAILS(isochrone_publisher_open(participant, far, &signal, 1, 0, &publisher), ISOCHRONE_ERROR_WRITER, is_far);
  EXPECT(strstr(isochrone_last_error(), arguments[3]) != NULL);
  EXPECT_FAILS(isochrone_publisher_take_over(participant, far, &signal, 1, 0, &publisher), ISOCHRONE_ERROR_WRITER,
               is_far);

  /* Nor can what a node says of itself. */
  EXPECT_FAILS(isochrone_publisher_take_over(participant, "isochrone/x", &signal, 1, 0, &publisher),
               ISOCHRONE_ERROR_SERVICE, "choose another name, such as \"plant/x\"");

  /* A program that is not of isochrone writes it here. */
  const char *plain = arguments[2];
  EXPECT_FAILS(isochrone_publisher_open(participant, plain, &signal, 1, 0, &publisher), ISOCHRONE_ERROR_WRITER,
               "take the service over from it");
  EXPECT(publisher == NULL);
  EXPECT(strstr(isochrone_last_error(), arguments[3]) != NULL);
  EXPECT(isochrone_publisher_take_over(participant, plain, &signal, 1, 0, &publisher) == ISOCHRONE_OK);

  /* Now one of isochrone does. */
  EXPECT_FAILS(isochrone_publisher_take_over(participant, plain, &signal, 1, 0, &second), ISOCHRONE_ERROR_WRITER,
               "c/writers");
  EXPECT(second == NULL);
  EXPECT(isochrone_publisher_close(publisher) == ISOCHRONE_OK);
  EXPECT(isochrone_participant_leave(participant) == ISOCHRONE_OK);
  puts("done");
  return 0;
}
