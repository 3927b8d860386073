// A device that is host memory, for tests of ist.gpu: what ist::ist and the module ask of CUDA.
//
// Work of a stream is done as late as can be, when somebody waits for it, and then no more than is
// needed. So what is freed, spoiled or read too early is seen.

#include <ist/bake.h>
#include <ist/gpu.h>
#include <ist/gpu_query.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "cuda_calls.h"
#include "support/host_batch.h"

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

struct CUevent_st {
  std::shared_ptr<Event> event;
};

namespace ist {

bool gpu_available(int device, std::string*) { return device == 0; }
GpuInfo gpu_info(int) { return {"emulated", 90, 0, 0}; }

struct GpuAssets::Impl {
  std::vector<Asset> copies;
  std::shared_ptr<bool> there = std::make_shared<bool>(true);
};

GpuAssets::GpuAssets(std::span<const TreeView> assets, const GpuSettings&)
    : impl_(std::make_unique<Impl>()) {
  for (const TreeView& asset : assets)
    impl_->copies.emplace_back(
        std::span(reinterpret_cast<const std::byte*>(&asset.header()), asset.header().file_bytes),
        "emulated");
}
GpuAssets::~GpuAssets() { *impl_->there = false; }
std::size_t GpuAssets::size() const noexcept { return impl_->copies.size(); }
std::size_t GpuAssets::bytes() const noexcept {
  std::size_t sum = 0;
  for (const Asset& asset : impl_->copies) sum += asset.bytes().size();
  return sum;
}
int GpuAssets::device() const noexcept { return 0; }

struct GpuWorkspace::Impl {
  std::size_t most_pairs;
  std::shared_ptr<bool> there = std::make_shared<bool>(true);
};
GpuWorkspace::GpuWorkspace(std::size_t most_pairs, const GpuSettings&)
    : impl_(std::make_unique<Impl>(Impl{most_pairs})) {}
GpuWorkspace::~GpuWorkspace() { *impl_->there = false; }
std::size_t GpuWorkspace::most_pairs() const noexcept { return impl_->most_pairs; }

void penetration_batch(const GpuAssets& assets, const GpuPairs& pairs, Measure measure,
                       GpuWorkspace& workspace, const GpuPenetrations& to, CUstream_st* stream) {
  if (pairs.count > workspace.most_pairs()) std::abort();
  const auto work = [&impl = assets.impl(), pairs, measure, to, there = assets.impl().there,
                     room = workspace.impl().there] {
    if (!*there || !*room) std::abort();
    std::vector<TreeView> views;
    for (const Asset& asset : impl.copies) views.push_back(asset.view());
    std::vector<testing::BatchPair> rows(pairs.count);
    for (std::size_t i = 0; i < pairs.count; ++i) {
      testing::BatchPair& row = rows[i];
      row.a = pairs.asset_a[i];
      row.b = pairs.asset_b[i];
      if (pairs.pose_a != nullptr) row.pose_a = pairs.pose_a[i];
      if (pairs.pose_b != nullptr) row.pose_b = pairs.pose_b[i];
      if (pairs.scale_a != nullptr) row.scale_a = pairs.scale_a[i];
      if (pairs.scale_b != nullptr) row.scale_b = pairs.scale_b[i];
    }
    const auto put = [](auto* column, std::size_t i, const auto& value) {
      if (column != nullptr)
        std::memcpy(column + i * (sizeof value / sizeof *column), &value, sizeof value);
    };
    const std::vector<Penetration> found = testing::HostBatch(views).run(rows, measure);
    for (std::size_t i = 0; i < found.size(); ++i) {
      put(to.volume, i, found[i].volume);
      put(to.centroid, i, found[i].centroid);
      put(to.translation_gradient, i, found[i].translation_gradient);
      put(to.rotation_gradient, i, found[i].rotation_gradient);
      put(to.status, i, found[i].status);
      put(to.node_visits, i, found[i].node_visits);
      put(to.sphere_pairs, i, found[i].sphere_pairs);
    }
  };
  add(stream, {work, nullptr, nullptr});
}

}  // namespace ist

namespace ist::python::cuda {

Moment::Moment(int device, Stream stream)
    : device_(device), event_(new CUevent_st{record(stream)}) {}
Moment::~Moment() { delete event_; }
bool Moment::passed() const { return event_->event->passed; }
void Moment::wait() const { finish(*event_->event); }
void Moment::hold(Stream stream) const { add(stream, {{}, event_->event, nullptr}); }

Block::~Block() { dropped()[data_] = sizes()[data_]; }

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

Repeated::Repeated(int device, std::uint32_t number, std::size_t count, Stream stream)
    : device_(device), stream_(stream), data_(std::malloc(std::max<std::size_t>(1, 4 * count))) {
  std::fill_n(static_cast<std::uint32_t*>(data_), count, number);
}
Repeated::~Repeated() {
  add(stream_, {[data = data_] { std::free(data); }, nullptr, nullptr});
}

int device_of(const void*) { return 0; }
bool captures(int, Stream stream) { return reinterpret_cast<std::uintptr_t>(stream) == 77; }

void copy_to_host(void* to, const void* from, std::size_t bytes, int, const Moment& moment) {
  moment.wait();
  std::memcpy(to, from, bytes);
}

}  // namespace ist::python::cuda
