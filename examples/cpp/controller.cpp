// A PI controller in place of node "pump": holds the pressure of sensor.cpp at 2 bar by a relief valve, which
// actuator.cpp moves. Every 5 ms it commands a position; without a good pressure for 50 ms its own safe one, with flags
// that say so. Ctrl-C ends it.

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>

#include <isochrone.hpp>

using namespace std::chrono_literals;

constexpr auto PERIOD = 5ms;
constexpr double PERIOD_S = std::chrono::duration<double>(PERIOD).count();
constexpr auto MAX_AGE = 50ms;
constexpr double SETPOINT = 2.0;  // bar
constexpr double GAIN = 40.0;     // % per bar
constexpr double RESET_TIME_S = 10.0;
constexpr double SAFE = 0.0;  // %

static volatile std::sig_atomic_t ending = 0;

// Opens the valve from 0 to 100 % when the pressure is too high.
class Controller {
 public:
  double step(double pressure) {
    const double proportional = GAIN * (pressure - SETPOINT);
    // Bounded, so that it does not wind up while the valve is at its end.
    integral_ = std::clamp(integral_ + proportional * PERIOD_S / RESET_TIME_S, 0.0, 100.0);
    return std::clamp(proportional + integral_, 0.0, 100.0);
  }
  void reset() { integral_ = SAFE; }

 private:
  double integral_ = SAFE;
};

int main() try {
  std::signal(SIGINT, [](int) { ending = 1; });
  std::signal(SIGTERM, [](int) { ending = 1; });
  auto participant = isochrone::Participant::join("pump/controller").value();
  auto pressure = participant.subscriber("plant/pressure", {"pressure"}).value();
  auto valve = participant.publisher("plant/valve", {{"valve.y", "LREAL", "%"}}, PERIOD).value();
  auto pace = isochrone::Pace::every(PERIOD, 500us).value();  // the sensor is at 150 us, the actuator at 1 ms
  std::printf("controls plant/valve\n");
  std::fflush(stdout);
  Controller controller;
  isochrone::Frame measured;  // the newest one, but for its values, which are valid until the next is looked for
  double value = 0.0;
  bool was_good = false;
  auto command = valve.loan();
  while (auto release = pace.wait()) {
    const bool is_last = ending;
    if (auto frame = pressure.newest()) {
      measured = frame;
      value = frame[0];
    }
    const bool is_good = measured && !measured.in_doubt() && std::isfinite(value) && measured.age() <= MAX_AGE;
    if (is_good) {
      release->source_ns = measured->source_ns;
      release->flags = isochrone_flags_handed_on(measured->flags);
    } else {
      controller.reset();
      release->flags = ISOCHRONE_STALE | ISOCHRONE_SUBSTITUTE;
    }
    if (is_last) release->flags |= ISOCHRONE_STOPPED;
    if (command) command[0] = is_good ? controller.step(value) : SAFE;
    if (!valve.send(*release)) std::fprintf(stderr, "%s\n", isochrone_last_error());
    if (is_last) break;
    command = valve.loan();  // in the slack
    pressure.maintain();
    if (is_good != was_good) {
      was_good = is_good;
      std::printf(is_good ? "controls\n" : "safe: no good pressure\n");
      std::fflush(stdout);
    }
  }
} catch (const isochrone::Exception& exception) {
  std::fprintf(stderr, "controller: %s\n", exception.what());
  return 1;
}
