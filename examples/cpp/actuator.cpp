// An actuator: moves a valve every 5 ms as node "pump" says, and closes it when the newest value is older than 50 ms, in
// doubt or no number, or its sender has ended. Ctrl-C ends it.

#include <cmath>
#include <csignal>
#include <cstdio>

#include <isochrone.hpp>

using namespace std::chrono_literals;

constexpr std::uint64_t MAX_AGE_NS = 50'000'000;
constexpr double CLOSED = 0.0;

static volatile std::sig_atomic_t ending = 0;

// Here the device would be moved. In percent.
static void move_valve(double) {}

int main() try {
  std::signal(SIGINT, [](int) { ending = 1; });
  std::signal(SIGTERM, [](int) { ending = 1; });
  auto participant = isochrone::Participant::join("pump/actuator").value();
  auto valve = participant.subscriber("plant/valve", {"valve.y"}).value();
  // 1 ms after the task, whose frame has come by then.
  auto pace = isochrone::Pace::every(5ms, 1ms).value();
  std::printf("reads plant/valve\n");
  std::fflush(stdout);
  double position = CLOSED;
  std::uint64_t sampled_ns = 0;
  bool is_usable = false, is_open = false;
  while (!ending && pace.wait()) {
    if (auto frame = valve.newest()) {
      position = frame[0];
      sampled_ns = frame->sampled_ns;
      is_usable = !frame.in_doubt() && std::isfinite(position);
    }
    const bool is_good = is_usable && isochrone::now_ns() - sampled_ns <= MAX_AGE_NS;
    move_valve(is_good ? position : CLOSED);
    if (is_good != is_open) {
      is_open = is_good;
      is_good ? std::printf("follows: %.1f %%\n", position) : std::printf("closed: no good value\n");
      std::fflush(stdout);
    }
    valve.maintain();  // in the slack
  }
  move_valve(CLOSED);
} catch (const isochrone::Exception& exception) {
  std::fprintf(stderr, "actuator: %s\n", exception.what());
  return 1;
}
