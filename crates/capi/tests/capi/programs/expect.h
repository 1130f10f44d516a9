/* Expectations of the test programs: one that is not met ends the program with its line. */
#ifndef EXPECT_H
#define EXPECT_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <isochrone.h>

#define EXPECT(condition)                                                                              \
  do {                                                                                                 \
    if (!(condition)) {                                                                                \
      fprintf(stderr, "%s:%d: %s (%s)\n", __FILE__, __LINE__, #condition, isochrone_last_error());     \
      exit(1);                                                                                         \
    }                                                                                                  \
  } while (0)

/* The call fails with this status, and its sentence has this part. */
#define EXPECT_FAILS(call, status, part) \
  do {                                   \
    EXPECT((call) == (status));          \
    EXPECT(strstr(isochrone_last_error(), part) != NULL); \
  } while (0)

#endif
