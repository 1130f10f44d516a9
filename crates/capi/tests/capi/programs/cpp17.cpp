// isochrone.hpp does what its header says, with exceptions and without.
#include <isochrone.hpp>

#include <cstring>
#include <thread>

#include "expect.h"

using namespace std::chrono_literals;

static void pace_is_on_the_grid() {
  auto pace = isochrone::Pace::every(5ms, 150us).value();
  auto first = pace.wait(), second = pace.wait();
  EXPECT(first && second && first->release_ns % 5'000'000 == 650'000);
  EXPECT(second->release_ns - first->release_ns == (second->cycle - first->cycle) * 5'000'000);
  EXPECT(second->cycle == 1 + second->missed && isochrone::now_ns() >= second->release_ns);
  std::thread([&] { EXPECT(!pace.wait()); }).join();
  auto moved = std::move(pace);
  EXPECT(moved.wait() && !pace.wait());
}

static void what_fails_is_a_sentence() {
  auto pace = isochrone::Pace::every(5ms, 5ms);
  EXPECT(!pace && pace.error().status == ISOCHRONE_ERROR_ARGUMENT);
  EXPECT(pace.error().message.find("not less than the period") != std::string::npos);
#ifdef ISOCHRONE_HAS_EXCEPTIONS
  try {
    isochrone::Pace::every(0ms).value();
    EXPECT(false);
  } catch (const isochrone::Exception& exception) {
    EXPECT(exception.error().status == ISOCHRONE_ERROR_ARGUMENT);
    EXPECT(std::strstr(exception.what(), "not above 0 ns"));
  }
#endif
}

static void frames_go_from_a_publisher_to_a_subscriber() {
  auto participant = isochrone::Participant::join("cpp").value();
  auto wanted = participant.subscriber("plant/cpp", {"b"}).value();
  auto all = participant.subscriber("plant/cpp").value();
  EXPECT(!wanted.newest() && !wanted.newest().failed());
  auto publisher = participant.publisher("plant/cpp", {{"a", "INT", nullptr}, {"b", nullptr, "m"}}, 5ms).value();
  auto values = publisher.loan();
  EXPECT(values && values.size() == 2);
  values[0] = 1;
  values[1] = 2.5;
  EXPECT(publisher.send());
  EXPECT(!publisher.send());
  auto frame = wanted.wait(60s);
  EXPECT(frame && frame.size() == 1 && frame[0] == 2.5 && !frame.in_doubt() && frame.age() >= 0ns);
  auto signal = wanted.signal(0);
  EXPECT(signal && std::strcmp(signal->unit, "m") == 0 && !wanted.signal(1));
  frame = all.wait(60s);
  double sum = 0;
  for (double value : frame) sum += value;
  EXPECT(frame && sum == 3.5);
  for (auto& value : publisher.loan()) value = 4;
  isochrone::Stamp last{};
  last.flags = ISOCHRONE_STOPPED;
  EXPECT(publisher.send(last));
  frame = all.next();
  EXPECT(frame && frame[1] == 4 && frame.in_doubt());
  EXPECT(frame->sequence == 2 && frame->lost == 1);  // the one that was not loaned
  wanted.maintain();
  EXPECT(!participant.client("nobody") && !participant.publisher("plant/cpp", {{"a", nullptr, nullptr}}));
}

int main() {
  pace_is_on_the_grid();
  what_fails_is_a_sentence();
  frames_go_from_a_publisher_to_a_subscriber();
  std::puts("done");
}
