#include "emulated_device.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <utility>

#include "cuda_calls.h"

namespace {

using ist::python::cuda::Stream;

struct Event {
  bool passed = false;
  Stream stream = nullptr;
};

struct Task {
  std::function<void()> work;
  std::shared_ptr<Event> needed, done;
};

std::map<Stream, std::deque<Task>>& streams() {
  static std::map<Stream, std::deque<Task>> all;
  return all;
}

void add(Stream stream, Task task) { streams()[stream].push_back(std::move(task)); }

std::shared_ptr<Event> record(Stream stream) {
  const auto event = std::make_shared<Event>(Event{false, stream});
  add(stream, {{}, nullptr, event});
  return event;
}

void finish(const Event& event) {
  while (!event.passed) {
    const Task task = std::move(streams().at(event.stream).front());
    streams()[event.stream].pop_front();
    if (task.needed) finish(*task.needed);
    if (task.work) task.work();
    if (task.done) task.done->passed = true;
  }
}

void finish_all() {
  for (auto& [stream, tasks] : streams())
    if (!tasks.empty()) finish(*record(stream));
}

/// Blocks, and those without an owner.
std::map<void*, std::size_t>& sizes() {
  static std::map<void*, std::size_t> all;
  return all;
}
std::map<void*, std::size_t>& dropped() {
  static std::map<void*, std::size_t> all;
  return all;
}

}  // namespace

void ist::testing::do_later(CUstream_st* stream, std::function<void()> work) {
  add(stream, {std::move(work), nullptr, nullptr});
}

struct CUevent_st {
  std::shared_ptr<Event> event;
};

namespace ist::python::cuda {

Moment::Moment(int device, Stream stream)
    : device_(device), event_(new CUevent_st{record(stream)}) {}
Moment::~Moment() { delete event_; }
bool Moment::passed() const { return event_->event->passed; }
void Moment::wait() const { finish(*event_->event); }
void Moment::hold(Stream stream) const { add(stream, {{}, event_->event, nullptr}); }

Block::~Block() {
  if (data_ != nullptr) dropped()[data_] = sizes()[data_];
}

std::shared_ptr<Block> allocate(int device, std::size_t bytes, Stream) {
  if (!dropped().empty()) finish_all();
  for (const auto& [data, size] : dropped()) {
    std::memset(data, 0xDD, size);  // so that who reads on sees it without a sanitizer too
    std::free(data);
  }
  dropped().clear();
  void* const data = std::malloc(bytes);
  sizes()[data] = bytes;
  return std::make_shared<Block>(device, data);
}

void clear(const Block& block, std::size_t bytes, Stream stream) {
  add(stream, {[data = block.data(), bytes] { std::memset(data, 0, bytes); }, nullptr, nullptr});
}

Repeated::Repeated(int device, std::uint32_t number, std::size_t count, Stream stream)
    : device_(device), stream_(stream), data_(std::malloc(std::max<std::size_t>(1, 4 * count))) {
  std::fill_n(static_cast<std::uint32_t*>(data_), count, number);
}
Repeated::~Repeated() {
  add(stream_, {[data = data_] { std::free(data); }, nullptr, nullptr});
}

/// Cards 1, 2, … have the memory that test_emulated_gpu.py maps there; all else is card 0's.
int device_of(const void* memory) {
  const std::uintptr_t place = reinterpret_cast<std::uintptr_t>(memory) >> 36;
  return place > 0x300 && place < 0x310 ? static_cast<int>(place - 0x300) : 0;
}
bool captures(int, Stream stream) { return reinterpret_cast<std::uintptr_t>(stream) == 77; }

void copy_to_host(void* to, const void* from, std::size_t bytes, int, const Moment& moment) {
  moment.wait();
  std::memcpy(to, from, bytes);
}

}  // namespace ist::python::cuda
