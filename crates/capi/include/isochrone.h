/*
 * isochrone.h: exchange values with isochrone's nodes and other programs in real time.
 *
 * A program joins a domain once (isochrone_participant_join) and opens publishers, subscribers, clients and paces. What
 * it opened belongs to the thread that opened it; the participant belongs to all threads. A handle that is NULL, closed
 * or of another thread is an error of the call. What a thread leaves open ends with the thread.
 *
 * Every call returns an isochrone_status. Below 0 it is an error, and isochrone_last_error() is a sentence with what is
 * wrong and the way out, for each thread its own.
 *
 * In a cycle, call isochrone_pace_wait, isochrone_subscriber_newest and isochrone_publisher_send, and in the slack after
 * it isochrone_publisher_loan and isochrone_subscriber_maintain. Everything else is for before and after.
 *
 * All texts are UTF-8. All times are in ns; instants are of CLOCK_MONOTONIC. What flags and ages mean:
 * docs/quality.md. What crosses between programs: docs/wire.md. First steps: docs/cpp.md.
 *
 * Generated from crates/capi/src by cbindgen.
 */


#ifndef ISOCHRONE_H
#define ISOCHRONE_H

#include <stddef.h>
#include <stdint.h>

// A source is older than its limit.
#define ISOCHRONE_STALE 1

// A source reads a default instead of a sample.
#define ISOCHRONE_SUBSTITUTE 2

// The newest sample of a source could not be taken; the one before stays.
#define ISOCHRONE_REJECTED 4

// A force acts on a signal, or upstream of it.
#define ISOCHRONE_FORCED 8

// The frame that a source came from was in doubt.
#define ISOCHRONE_UPSTREAM 16

// A block upstream of a signal reports an error.
#define ISOCHRONE_ERROR 32

// The sender's last frame: it ends.
#define ISOCHRONE_STOPPED 64

// An input began with its value of an earlier run, and no sample has come for it yet.
#define ISOCHRONE_RESTORED 128

// Any of those with which values are in doubt: STALE, SUBSTITUTE, REJECTED, UPSTREAM, ERROR and RESTORED.
#define ISOCHRONE_IN_DOUBT 183

// How a call went. What is below 0 is an error, and isochrone_last_error() says in a sentence what is wrong and what to
// do about it.
typedef enum isochrone_status {
  // Done.
  ISOCHRONE_OK = 0,
  // There is no frame yet. No error, and without a sentence.
  ISOCHRONE_NOTHING = 1,
  // A pointer is NULL that must not be, a text is not UTF-8, or a number is out of range.
  ISOCHRONE_ERROR_ARGUMENT = -1,
  // The handle was closed, or is none.
  ISOCHRONE_ERROR_CLOSED = -2,
  // The handle belongs to another thread.
  ISOCHRONE_ERROR_THREAD = -3,
  // The domain cannot be found or joined.
  ISOCHRONE_ERROR_DOMAIN = -4,
  // The service cannot be opened.
  ISOCHRONE_ERROR_SERVICE = -5,
  // Somebody else writes the service.
  ISOCHRONE_ERROR_WRITER = -6,
  // No frame could be loaned or sent.
  ISOCHRONE_ERROR_FRAME = -7,
  // A frame lacks a signal that was asked for, or its publisher announces no names.
  ISOCHRONE_ERROR_SIGNAL = -8,
  // The node does not run, or gave no answer.
  ISOCHRONE_ERROR_NODE = -9,
  // The node refused the call; the answer has its reasons.
  ISOCHRONE_ERROR_REFUSED = -10,
  // A fault of this library. Close the handle that was used.
  ISOCHRONE_ERROR_INTERNAL = -11,
} isochrone_status;

// How much a remark matters.
typedef enum isochrone_level {
  // Something does not work.
  ISOCHRONE_LEVEL_ERROR = 1,
  // Something may not work, such as a process that is stopped and holds up others.
  ISOCHRONE_LEVEL_WARNING = 2,
  // What is opened and joined.
  ISOCHRONE_LEVEL_INFO = 3,
} isochrone_level;

// A client of a node. It belongs to the thread that opened it.
typedef struct isochrone_client isochrone_client;

// Waits on the grid on which the nodes of this machine release their tasks. It belongs to the thread that opened it.
typedef struct isochrone_pace isochrone_pace;

// A program in a domain. Any thread may use it.
typedef struct isochrone_participant isochrone_participant;

// The writer of a service. It belongs to the thread that opened it.
typedef struct isochrone_publisher isochrone_publisher;

// A reader of a service. It belongs to the thread that opened it.
typedef struct isochrone_subscriber isochrone_subscriber;

// A value of a frame: its name, and what it is.
typedef struct isochrone_signal {
  // Such as "level.y".
  const char *name;
  // "LREAL", "INT", "BOOL", "TIME" or "WORD". NULL is LREAL when a publisher is opened, and unknown in what a
  // subscriber learned.
  const char *type;
  // Such as "m"; NULL: none.
  const char *unit;
} isochrone_signal;

// What the sender of a frame knows about it. All zero is fine for a program without cycles.
typedef struct isochrone_stamp {
  // Index of the cycle, those that were left out included.
  uint64_t cycle;
  // When the cycle was due, in ns of CLOCK_MONOTONIC.
  uint64_t release_ns;
  // Time of the oldest sample behind the values: source_ns of the frames that they are computed from; 0: none.
  uint64_t source_ns;
  // Cycles left out since the start.
  uint64_t missed;
  // What the values are worth: ISOCHRONE_STALE and so on; 0: nothing to say.
  uint64_t flags;
} isochrone_stamp;

// A frame that was received. All times are in ns of CLOCK_MONOTONIC.
typedef struct isochrone_frame {
  // The values of the wanted signals in the order in which they were named; of all signals, where the publisher wrote
  // them, if none was named. Valid until the next call with this subscriber.
  const double *values;
  // How many values there are.
  size_t count;
  // What they are worth: ISOCHRONE_STALE and so on; 0: nothing is known to be wrong.
  uint64_t flags;
  // From when on the values age: isochrone_now_ns() - sampled_ns is how old they are. When the frame was sent, or when
  // it came if the sender has another clock.
  uint64_t sampled_ns;
  // When the frame was received.
  uint64_t received_ns;
  // Time of the oldest sample behind the values, to be passed on in the stamp of what is computed from them.
  uint64_t source_ns;
  // When the sender's cycle was due; 0 if it has none.
  uint64_t release_ns;
  // When the frame was sent, by the sender's clock.
  uint64_t publish_ns;
  // 0, 1, 2 and so on of one publisher.
  uint64_t sequence;
  // The sender's cycle, those that it left out included.
  uint64_t cycle;
  // Cycles that the sender has left out since its start.
  uint64_t missed;
  // Frames that were lost between the one received before and this one.
  uint64_t lost;
  // How often the publisher was started again or replaced in between.
  uint64_t restarts;
} isochrone_frame;

// Receives a remark, a line of text that is valid during the call. It comes from any thread, also one of the library,
// and must not call the library.
typedef void (*isochrone_log_sink)(enum isochrone_level level, const char *message, void *context);

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The sentence of the last error in the calling thread; empty if there was none. It stays valid until the next error
// in this thread. Never NULL.
const char *isochrone_last_error(void);

// Joins a domain: the programs that exchange frames with each other.
//
// Call it in an ordinary thread, before any thread of the program gets a real-time priority: it takes milliseconds and
// starts a thread, which inherits priority and CPUs of the caller. That thread announces layouts, hears those of others
// and makes good failed connections. It blocks all signals. Do not fork while a participant is joined, except to exec.
//
// name: what others see of this program, such as "pump/sensor"; at most 128 ASCII characters.
// config_file: a configuration file of iceoryx2. NULL: that of the environment variable ICEORYX2_CONFIG, or else where
// iceoryx2 itself looks.
// participant: receives the handle; NULL on failure.
enum isochrone_status isochrone_participant_join(const char *name,
                                                 const char *config_file,
                                                 struct isochrone_participant **participant);

// Leaves the domain. Publishers, subscribers and clients that were opened with the participant stay usable; the domain
// is left when the last of them is closed. NULL is allowed.
enum isochrone_status isochrone_participant_leave(struct isochrone_participant *participant);

// Opens a service for writing, and announces its signals to all who read it. A service has one writer: where another
// lives, here or behind a link, ISOCHRONE_ERROR_WRITER names its node and process.
//
// signals: the values of each frame, in their order; they are copied.
// period_ns: the time between two frames; 0 if they come at no fixed rate. Readers that sleep wake up by it.
// publisher: receives the handle; NULL on failure.
enum isochrone_status isochrone_publisher_open(struct isochrone_participant *participant,
                                               const char *service,
                                               const struct isochrone_signal *signals,
                                               size_t count,
                                               uint64_t period_ns,
                                               struct isochrone_publisher **publisher);

// As isochrone_publisher_open(), and takes the service over from a living writer that is not of isochrone, such as one
// that uses iceoryx2 alone. Readers follow this publisher at once. One of isochrone, or behind a link, is refused still.
enum isochrone_status isochrone_publisher_take_over(struct isochrone_participant *participant,
                                                    const char *service,
                                                    const struct isochrone_signal *signals,
                                                    size_t count,
                                                    uint64_t period_ns,
                                                    struct isochrone_publisher **publisher);

// Gives the place for the values of the next frame, as many as there are signals, in shared memory. What is written
// there is sent in place.
//
// In a cycle, call it in the slack, after isochrone_publisher_send(): it allocates, and connects to readers that joined.
// Until the frame is sent, further calls give the same place with what was written. A new frame is all zero.
enum isochrone_status isochrone_publisher_loan(struct isochrone_publisher *publisher,
                                               double **values);

// Sends the frame that was loaned. Its values must not be touched afterwards. Without one, the number of this frame is
// left out, so that readers count it as lost.
//
// It neither waits nor allocates, and makes no system call unless a reader has just joined or left.
//
// stamp: NULL is one that is all zero.
enum isochrone_status isochrone_publisher_send(struct isochrone_publisher *publisher,
                                               const struct isochrone_stamp *stamp);

// Ends a publisher. NULL is allowed. Readers take its last values for good until they are too old: send a frame with
// ISOCHRONE_STOPPED first, to tell them at once.
enum isochrone_status isochrone_publisher_close(struct isochrone_publisher *publisher);

// Opens a service for reading. Publisher and subscriber may start in any order.
//
// names: the wanted signals, whose values each frame then gives in this order. They are found by the names that the
// publisher announces, also when it starts again with other signals. NULL with a count of 0: all signals as they are.
// subscriber: receives the handle; NULL on failure.
enum isochrone_status isochrone_subscriber_open(struct isochrone_participant *participant,
                                                const char *service,
                                                const char *const *names,
                                                size_t count,
                                                struct isochrone_subscriber **subscriber);

// Gives the newest frame and leaves out those before it: for what needs the present value. ISOCHRONE_NOTHING: none has
// come since the last one that was given.
//
// It never waits. While the publisher keeps its signals, it neither allocates nor makes a system call.
//
// ISOCHRONE_ERROR_SIGNAL: the frame lacks a wanted signal, or has no names. All but its values is there then.
enum isochrone_status isochrone_subscriber_newest(struct isochrone_subscriber *subscriber,
                                                  struct isochrone_frame *frame);

// Gives the next frame in line: for what needs every one. As isochrone_subscriber_newest() otherwise. Up to 256 frames
// wait; what the oldest of more were is told as `lost`.
enum isochrone_status isochrone_subscriber_next(struct isochrone_subscriber *subscriber, struct isochrone_frame *frame);

// Sleeps until there is a frame, and gives the next one in line. ISOCHRONE_NOTHING: none came in this time.
//
// It sleeps until the next frame is due by the period that the publisher announces; nobody has to wake it. A signal does
// not end it: to end on one, wait for a short time and look.
enum isochrone_status isochrone_subscriber_wait(struct isochrone_subscriber *subscriber,
                                                uint64_t timeout_ns,
                                                struct isochrone_frame *frame);

// Connects to publishers that joined, and takes what they announce: for the slack of a cycle, as it allocates then. The
// other calls do it every 10 ms if this is not called.
enum isochrone_status isochrone_subscriber_maintain(struct isochrone_subscriber *subscriber);

// What the values of the frame that was given last are: the signal of values[index]. Its texts are valid until a frame
// with other signals is given, and never NULL; an unknown type is empty, and so is no unit.
enum isochrone_status isochrone_subscriber_signal(struct isochrone_subscriber *subscriber,
                                                  size_t index,
                                                  struct isochrone_signal *signal);

// Ends a subscriber. NULL is allowed.
enum isochrone_status isochrone_subscriber_close(struct isochrone_subscriber *subscriber);

// Connects to a running node. For ordinary threads: its calls wait.
//
// node: its name, as in [node] of its configuration.
// timeout_ns: how long each call waits for its answer, in ns; 5 s are good.
// client: receives the handle; NULL on failure.
enum isochrone_status isochrone_client_open(struct isochrone_participant *participant,
                                            const char *node,
                                            uint64_t timeout_ns,
                                            struct isochrone_client **client);

// Calls a method of the node, such as "get" or "set", and waits for the answer. docs/control.md lists the methods.
//
// params: its parameters, a JSON object such as {"values": {"ramp.setChangeRate": 5.0}}; NULL: none.
// answer: receives the result as JSON. With ISOCHRONE_ERROR_REFUSED it receives the error object with code, message and
// data, and nothing was changed; with any other failure NULL. Valid until the next call with this client.
enum isochrone_status isochrone_client_call(struct isochrone_client *client,
                                            const char *method,
                                            const char *params,
                                            const char **answer);

// Ends a client. NULL is allowed.
enum isochrone_status isochrone_client_close(struct isochrone_client *client);

// The clock of all times here: CLOCK_MONOTONIC, in ns.
uint64_t isochrone_now_ns(void);

// Makes a pace: release n is due at k * 20 ms + 0.5 ms + phase_ns + n * period_ns, whole k, after the first wait. If the
// period divides 20 ms, every program with it is on one grid, whenever it started.
//
// phase_ns: how long after the releases of tasks without a phase; less than period_ns.
// pace: receives the handle; NULL on failure.
enum isochrone_status isochrone_pace_open(uint64_t period_ns,
                                          uint64_t phase_ns,
                                          struct isochrone_pace **pace);

// Sleeps until the next release. Releases that are over are left out and counted in `missed`. A signal does not end it.
//
// stamp: receives cycle, release_ns and missed of the release, for isochrone_publisher_send(); source_ns and flags are
// 0. NULL is allowed.
enum isochrone_status isochrone_pace_wait(struct isochrone_pace *pace, struct isochrone_stamp *stamp);

// Ends a pace. NULL is allowed.
enum isochrone_status isochrone_pace_close(struct isochrone_pace *pace);

// The flags for the stamp of what is computed from a frame with these flags: UPSTREAM if that was in doubt, and FORCED
// if it was.
uint64_t isochrone_flags_handed_on(uint64_t flags);

// The version of this library, such as "0.1.0".
const char *isochrone_version(void);

// Says who receives what the library remarks, for the whole program and once. Without it, nobody does. No call of a
// cycle remarks anything.
//
// context: is passed to the sink as it is.
enum isochrone_status isochrone_log_to(isochrone_log_sink sink, void *context);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* ISOCHRONE_H */
