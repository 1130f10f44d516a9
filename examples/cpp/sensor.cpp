// A sensor: sends a pressure every 5 ms on the grid of the nodes, 150 us after the releases of tasks without a phase.
// Ctrl-C ends it; its last frame says so, and readers know at once. For node "pump" of pump.toml.

#include <cmath>
#include <csignal>
#include <cstdio>

#include <isochrone.hpp>

using namespace std::chrono_literals;

static volatile std::sig_atomic_t ending = 0;

// Here the device would be read. In bar.
static double read_pressure(std::uint64_t cycle) { return 2.0 + 0.5 * std::sin(static_cast<double>(cycle) / 200.0); }

int main() try {
  std::signal(SIGINT, [](int) { ending = 1; });
  std::signal(SIGTERM, [](int) { ending = 1; });
  auto participant = isochrone::Participant::join("pump/sensor").value();
  auto pressure = participant.publisher("plant/pressure", {{"pressure", "LREAL", "bar"}}, 5ms).value();
  auto pace = isochrone::Pace::every(5ms, 150us).value();
  auto values = pressure.loan();
  std::printf("sends plant/pressure\n");
  std::fflush(stdout);
  while (auto release = pace.wait()) {
    const bool is_last = ending;
    if (is_last) release->flags = ISOCHRONE_STOPPED;
    if (values) values[0] = read_pressure(release->cycle);
    if (!pressure.send(*release)) std::fprintf(stderr, "%s\n", isochrone_last_error());
    if (is_last) break;
    values = pressure.loan();  // in the slack: the next frame is written where it will be read
  }
} catch (const isochrone::Exception& exception) {
  std::fprintf(stderr, "sensor: %s\n", exception.what());
  return 1;
}
