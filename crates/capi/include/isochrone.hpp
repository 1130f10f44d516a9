// isochrone.hpp: isochrone.h for C++17, header only. Handles close themselves; times are std::chrono durations.
//
// What can fail when it is opened returns a Result: look at it, or take its value(), which throws an isochrone::Exception
// or, in a program without exceptions, prints the sentence and aborts. What is called in a cycle neither throws nor
// allocates: it converts to false, and isochrone_last_error() says why.

#ifndef ISOCHRONE_HPP
#define ISOCHRONE_HPP

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "isochrone.h"

#if defined(__cpp_exceptions) || defined(__EXCEPTIONS) || defined(_CPPUNWIND)
#define ISOCHRONE_HAS_EXCEPTIONS 1
#endif

namespace isochrone {

using std::chrono::nanoseconds;

// A value of a frame: name, type ("LREAL" if it is nullptr), unit.
using Signal = isochrone_signal;
// What the sender of a frame knows about it.
using Stamp = isochrone_stamp;

// Why a call failed.
struct Error {
  isochrone_status status = ISOCHRONE_OK;
  std::string message;
  // What a node answered that refused a call: JSON with code, message and data.
  std::string answer;
};

#ifdef ISOCHRONE_HAS_EXCEPTIONS
class Exception : public std::runtime_error {
 public:
  explicit Exception(Error error) : std::runtime_error(error.message), error_(std::move(error)) {}
  const Error& error() const noexcept { return error_; }

 private:
  Error error_;
};
#endif

// A value, or why there is none.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : value_(std::move(value)) {}
  Result(Error error) : error_(std::move(error)) {}

  explicit operator bool() const noexcept { return value_.has_value(); }
  T& operator*() & noexcept { return *value_; }
  T* operator->() noexcept { return &*value_; }
  const Error& error() const noexcept { return error_; }

  T value() && {
    if (!value_) {
#ifdef ISOCHRONE_HAS_EXCEPTIONS
      throw Exception(std::move(error_));
#else
      std::fprintf(stderr, "isochrone: %s\n", error_.message.c_str());
      std::abort();
#endif
    }
    return std::move(*value_);
  }

 private:
  std::optional<T> value_;
  Error error_;
};

namespace detail {

inline Error failed(isochrone_status status) { return Error{status, isochrone_last_error(), {}}; }

inline std::uint64_t count(nanoseconds time) { return time.count() > 0 ? static_cast<std::uint64_t>(time.count()) : 0; }

// Closes a handle at its end.
template <class H, isochrone_status (*close)(H*)>
struct Closing {
  void operator()(H* handle) const noexcept { close(handle); }
};

template <class H, isochrone_status (*close)(H*)>
using Handle = std::unique_ptr<H, Closing<H, close>>;

}  // namespace detail

// CLOCK_MONOTONIC, in ns.
inline std::uint64_t now_ns() noexcept { return isochrone_now_ns(); }

// Waits on the grid on which the nodes of this machine release their tasks.
class Pace {
 public:
  static Result<Pace> every(nanoseconds period, nanoseconds phase = nanoseconds(0)) {
    isochrone_pace* handle = nullptr;
    const auto status = isochrone_pace_open(detail::count(period), detail::count(phase), &handle);
    if (status != ISOCHRONE_OK) return detail::failed(status);
    return Pace(handle);
  }

  // The next release; none where it was not this thread that made the pace.
  std::optional<Stamp> wait() noexcept {
    Stamp stamp{};
    if (isochrone_pace_wait(handle_.get(), &stamp) != ISOCHRONE_OK) return std::nullopt;
    return stamp;
  }

 private:
  explicit Pace(isochrone_pace* handle) : handle_(handle) {}
  detail::Handle<isochrone_pace, isochrone_pace_close> handle_;
};

// The place for the values of a frame, in shared memory; false: there is none.
class Values {
 public:
  Values(double* data, std::size_t size) noexcept : data_(data), size_(data ? size : 0) {}
  explicit operator bool() const noexcept { return data_ != nullptr; }
  double& operator[](std::size_t index) const noexcept { return data_[index]; }
  double* begin() const noexcept { return data_; }
  double* end() const noexcept { return data_ + size_; }
  std::size_t size() const noexcept { return size_; }

 private:
  double* data_;
  std::size_t size_;
};

// The writer of a service.
class Publisher {
 public:
  // The next frame, to be written in place. In a cycle, loan it in the slack.
  Values loan() noexcept {
    double* values = nullptr;
    isochrone_publisher_loan(handle_.get(), &values);
    return Values(values, count_);
  }

  // Sends the frame that was loaned.
  [[nodiscard]] bool send(const Stamp& stamp = Stamp{}) noexcept {
    return isochrone_publisher_send(handle_.get(), &stamp) == ISOCHRONE_OK;
  }

 private:
  friend class Participant;
  Publisher(isochrone_publisher* handle, std::size_t count) : handle_(handle), count_(count) {}
  detail::Handle<isochrone_publisher, isochrone_publisher_close> handle_;
  std::size_t count_;
};

// A frame that was received; its values are valid until the next call of its subscriber. False: there is none, or it
// lacks a signal.
class Frame {
 public:
  explicit operator bool() const noexcept { return status_ == ISOCHRONE_OK; }
  // Whether there is no frame because of an error.
  bool failed() const noexcept { return status_ < 0; }
  isochrone_status status() const noexcept { return status_; }
  const isochrone_frame* operator->() const noexcept { return &frame_; }
  const double& operator[](std::size_t index) const noexcept { return frame_.values[index]; }
  const double* begin() const noexcept { return frame_.values; }
  const double* end() const noexcept { return frame_.values + frame_.count; }
  std::size_t size() const noexcept { return frame_.count; }
  // How old the values are now.
  nanoseconds age() const noexcept { return nanoseconds(isochrone_now_ns() - frame_.sampled_ns); }
  // Whether the sender doubts them, or has ended.
  bool in_doubt() const noexcept { return (frame_.flags & (ISOCHRONE_IN_DOUBT | ISOCHRONE_STOPPED)) != 0; }

 private:
  friend class Subscriber;
  isochrone_status status_ = ISOCHRONE_NOTHING;
  isochrone_frame frame_{};
};

// A reader of a service.
class Subscriber {
 public:
  // The newest frame, without those before it.
  Frame newest() noexcept {
    Frame frame;
    frame.status_ = isochrone_subscriber_newest(handle_.get(), &frame.frame_);
    return frame;
  }

  // The next one in line.
  Frame next() noexcept {
    Frame frame;
    frame.status_ = isochrone_subscriber_next(handle_.get(), &frame.frame_);
    return frame;
  }

  // The next one in line, once it comes.
  Frame wait(nanoseconds timeout) noexcept {
    Frame frame;
    frame.status_ = isochrone_subscriber_wait(handle_.get(), detail::count(timeout), &frame.frame_);
    return frame;
  }

  // For the slack of a cycle.
  void maintain() noexcept { isochrone_subscriber_maintain(handle_.get()); }

  // What a value of the frame that was given last is.
  Result<Signal> signal(std::size_t index) {
    Signal signal{};
    const auto status = isochrone_subscriber_signal(handle_.get(), index, &signal);
    if (status != ISOCHRONE_OK) return detail::failed(status);
    return signal;
  }

 private:
  friend class Participant;
  explicit Subscriber(isochrone_subscriber* handle) : handle_(handle) {}
  detail::Handle<isochrone_subscriber, isochrone_subscriber_close> handle_;
};

// A client of a running node.
class Client {
 public:
  // Calls a method of docs/control.md; parameters and result are JSON.
  Result<std::string> call(const char* method, const char* params = "{}") {
    const char* answer = nullptr;
    const auto status = isochrone_client_call(handle_.get(), method, params, &answer);
    if (status == ISOCHRONE_OK) return std::string(answer);
    Error error = detail::failed(status);
    if (answer) error.answer = answer;
    return error;
  }

 private:
  friend class Participant;
  explicit Client(isochrone_client* handle) : handle_(handle) {}
  detail::Handle<isochrone_client, isochrone_client_close> handle_;
};

// A program in a domain. Any thread may open ports with it.
class Participant {
 public:
  // config_file: nullptr for the file of ICEORYX2_CONFIG, or else where iceoryx2 itself looks.
  static Result<Participant> join(const char* name, const char* config_file = nullptr) {
    isochrone_participant* handle = nullptr;
    const auto status = isochrone_participant_join(name, config_file, &handle);
    if (status != ISOCHRONE_OK) return detail::failed(status);
    return Participant(handle);
  }

  // period: the time between two frames; 0 if they come at no fixed rate.
  Result<Publisher> publisher(const char* service, const Signal* signals, std::size_t count,
                              nanoseconds period = nanoseconds(0)) {
    return publisher_by(isochrone_publisher_open, service, signals, count, period);
  }

  Result<Publisher> publisher(const char* service, std::initializer_list<Signal> signals,
                              nanoseconds period = nanoseconds(0)) {
    return publisher(service, signals.begin(), signals.size(), period);
  }

  // As publisher(), and takes the service over from a living writer that is not of isochrone.
  Result<Publisher> take_over(const char* service, const Signal* signals, std::size_t count,
                              nanoseconds period = nanoseconds(0)) {
    return publisher_by(isochrone_publisher_take_over, service, signals, count, period);
  }

  Result<Publisher> take_over(const char* service, std::initializer_list<Signal> signals,
                              nanoseconds period = nanoseconds(0)) {
    return take_over(service, signals.begin(), signals.size(), period);
  }

  // names: the wanted signals; none: all.
  Result<Subscriber> subscriber(const char* service, const char* const* names, std::size_t count) {
    isochrone_subscriber* handle = nullptr;
    const auto status = isochrone_subscriber_open(handle_.get(), service, names, count, &handle);
    if (status != ISOCHRONE_OK) return detail::failed(status);
    return Subscriber(handle);
  }

  Result<Subscriber> subscriber(const char* service, std::initializer_list<const char*> names = {}) {
    return subscriber(service, names.begin(), names.size());
  }

  // timeout: how long each call waits for its answer.
  Result<Client> client(const char* node, nanoseconds timeout = std::chrono::seconds(5)) {
    isochrone_client* handle = nullptr;
    const auto status = isochrone_client_open(handle_.get(), node, detail::count(timeout), &handle);
    if (status != ISOCHRONE_OK) return detail::failed(status);
    return Client(handle);
  }

 private:
  template <typename Open>
  Result<Publisher> publisher_by(Open open, const char* service, const Signal* signals, std::size_t count,
                                 nanoseconds period) {
    isochrone_publisher* handle = nullptr;
    const auto status = open(handle_.get(), service, signals, count, detail::count(period), &handle);
    if (status != ISOCHRONE_OK) return detail::failed(status);
    return Publisher(handle, count);
  }

  explicit Participant(isochrone_participant* handle) : handle_(handle) {}
  detail::Handle<isochrone_participant, isochrone_participant_leave> handle_;
};

}  // namespace isochrone

#endif  // ISOCHRONE_HPP
