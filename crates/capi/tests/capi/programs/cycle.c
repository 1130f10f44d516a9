/* A cycle and its slack make no system call while nobody joins or leaves: the first would end the program. */
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stddef.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "expect.h"

#define S 1000000000ull

static isochrone_participant *participant;
static atomic_int done;

/* From now on, any system call of the thread but its end kills the process. */
static void allow_none(void) {
  struct sock_filter rules[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
  };
  const struct sock_fprog program = {sizeof rules / sizeof *rules, rules};
  EXPECT(prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0);
  EXPECT(prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0);
}

static void *cycles(void *unused) {
  const isochrone_signal signals[] = {{"a", NULL, NULL}, {"b", NULL, NULL}};
  const char *names[] = {"b"};
  isochrone_publisher *publisher;
  isochrone_subscriber *subscriber;
  isochrone_frame frame;
  double *values;
  (void)unused;
  EXPECT(isochrone_subscriber_open(participant, "x", names, 1, &subscriber) == ISOCHRONE_OK);
  EXPECT(isochrone_publisher_open(participant, "x", signals, 2, 0, &publisher) == ISOCHRONE_OK);
  for (int n = 0; n < 10000; n++) {
    EXPECT(isochrone_publisher_loan(publisher, &values) == ISOCHRONE_OK);
    values[1] = n;
    if (n == 1000) allow_none();
    EXPECT(isochrone_publisher_send(publisher, NULL) == ISOCHRONE_OK);
    if (n == 0) /* The names are heard. */
      EXPECT(isochrone_subscriber_wait(subscriber, 60 * S, &frame) == ISOCHRONE_OK);
    else
      EXPECT(isochrone_subscriber_newest(subscriber, &frame) == ISOCHRONE_OK);
    EXPECT(frame.count == 1 && frame.values[0] == n);
    EXPECT(isochrone_subscriber_maintain(subscriber) == ISOCHRONE_OK);
  }
  atomic_store(&done, 1);
  /* The only way out: it may not even end its ports. */
  syscall(SYS_exit, 0);
  return NULL;
}

int main(void) {
  const struct timespec look = {0, 10000000};
  const uint64_t until_ns = isochrone_now_ns() + 120 * S;
  pthread_t thread;
  EXPECT(isochrone_participant_join("c/cycle", NULL, &participant) == ISOCHRONE_OK);
  EXPECT(pthread_create(&thread, NULL, cycles, NULL) == 0);
  while (!atomic_load(&done) && isochrone_now_ns() < until_ns) nanosleep(&look, NULL);
  EXPECT(atomic_load(&done));
  puts("done");
  return 0;
}
