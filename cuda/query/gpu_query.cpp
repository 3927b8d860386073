#include <ist/gpu_query.h>

#include <ist/error.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "cuda/check.h"
#include "cuda/query/batch_kernels.h"
#include "cuda/query/separation_kernels.h"
#include "cuda/queue.h"

namespace ist {
namespace {

/// Room for what is split, a kind. A batch that needs more is answered all the same.
constexpr std::uint32_t kSplitRoom = 1 << 16, kTaskRoom = 1 << 19, kEntryRoom = 1 << 21;
constexpr std::uint32_t kGapEntryRoom = 1 << 20;  ///< of separations, whose entries are larger

/// Device memory that outlives the queue it comes from.
class DeviceBytes {
 public:
  DeviceBytes() = default;
  DeviceBytes(gpu::Queue& queue, const GpuSettings& settings, std::size_t bytes)
      : settings_(settings), data_(queue.allocate(bytes)), bytes_(bytes) {}
  ~DeviceBytes() {
    if (data_ == nullptr) return;
    try {
      gpu::Queue(settings_).deallocate(data_, bytes_);
    } catch (const Error&) {  // a device that is gone has no memory to give back
    }
  }
  DeviceBytes(DeviceBytes&& other) noexcept { *this = std::move(other); }
  DeviceBytes& operator=(DeviceBytes&& other) noexcept {
    std::swap(settings_, other.settings_);
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }

  std::byte* data() const { return static_cast<std::byte*>(data_); }
  std::size_t bytes() const { return bytes_; }

 private:
  GpuSettings settings_;
  void* data_ = nullptr;
  std::size_t bytes_ = 0;
};

/// Parts of a block of memory, one after another.
class Parts {
 public:
  explicit Parts(std::byte* from) : from_(from) {}

  template <class T>
  T* take(std::size_t count) {
    T* const part = reinterpret_cast<T*>(from_ + used_);
    used_ += (count * sizeof(T) + 255) / 256 * 256;
    return part;
  }
  std::size_t used() const { return used_; }

 private:
  std::byte* from_;
  std::size_t used_ = 0;
};

void copy(void* to, const void* from, std::size_t bytes, gpu::Queue& queue) {
  gpu::check(cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, queue.stream()),
             "copying assets to the GPU");
}

}  // namespace

struct GpuAssets::Impl {
  int device = 0;
  DeviceBytes memory;
  const gpu::AssetRef* refs = nullptr;
  std::size_t size = 0;
};

GpuAssets::GpuAssets(std::span<const TreeView> assets, const GpuSettings& settings)
    : impl_(std::make_unique<Impl>()) {
  gpu_info(settings.device);  // throws where there is no such device
  gpu::Queue queue(settings);
  Parts sizes(nullptr);
  sizes.take<gpu::AssetRef>(assets.size());
  for (const TreeView& asset : assets) {
    if (asset.empty()) throw Error("GPU: an asset of the batch is empty");
    sizes.take<std::byte>(asset.header().file_bytes);
  }
  impl_->device = settings.device;
  impl_->size = assets.size();
  impl_->memory = DeviceBytes(queue, settings, sizes.used());
  Parts parts(impl_->memory.data());
  auto* const refs = parts.take<gpu::AssetRef>(assets.size());
  std::vector<gpu::AssetRef> host;
  for (const TreeView& asset : assets) {
    const AssetHeader& header = asset.header();
    auto* const bytes = parts.take<std::byte>(header.file_bytes);
    copy(bytes, &header, header.file_bytes, queue);
    host.push_back(gpu::AssetRef::of(header, bytes));
  }
  if (!host.empty()) copy(refs, host.data(), host.size() * sizeof(gpu::AssetRef), queue);
  impl_->refs = refs;
  queue.wait();
}

GpuAssets::~GpuAssets() = default;
GpuAssets::GpuAssets(GpuAssets&&) noexcept = default;
GpuAssets& GpuAssets::operator=(GpuAssets&&) noexcept = default;

std::size_t GpuAssets::size() const noexcept { return impl_->size; }
std::size_t GpuAssets::bytes() const noexcept { return impl_->memory.bytes(); }
int GpuAssets::device() const noexcept { return impl_->device; }

struct GpuWorkspace::Impl {
  int device = 0;
  std::size_t most_pairs = 0;
  gpu::BatchGrids grids{};
  gpu::SeparationGrids separation_grids{};
  DeviceBytes memory;
  // What does not change from batch to batch; both lie in the same memory.
  gpu::BatchArrays arrays{};
  gpu::SeparationArrays separations{};

  /// Sets the arrays to parts of the memory at `from`; returns the bytes they take.
  std::size_t place(std::byte* from) {
    return std::max(place_penetrations(from), place_separations(from));
  }

 private:
  void place_common(Parts& parts, gpu::BatchArrays& arrays) const {
    arrays.counters = parts.take<gpu::BatchCounters>(1);
    for (std::uint32_t*& list : arrays.list) list = parts.take<std::uint32_t>(most_pairs);
    arrays.splits = parts.take<gpu::SplitPair>(kSplitRoom);
    arrays.tasks = parts.take<gpu::PairTask>(kTaskRoom);
    arrays.split_room = kSplitRoom;
    arrays.task_room = kTaskRoom;
  }

  std::size_t place_penetrations(std::byte* from) {
    Parts parts(from);
    place_common(parts, arrays);
    arrays.totals = parts.take<gpu::LensTotals>(kSplitRoom + kTaskRoom);
    arrays.entries_a = parts.take<std::uint32_t>(kEntryRoom);
    arrays.entries_b = parts.take<std::uint32_t>(kEntryRoom);
    arrays.entry_room = kEntryRoom;
    return parts.used();
  }

  std::size_t place_separations(std::byte* from) {
    Parts parts(from);
    gpu::BatchArrays& pairs = separations.pairs;
    place_common(parts, pairs);
    separations.totals = parts.take<gpu::GapTotals>(kSplitRoom + kTaskRoom);
    separations.entries = {parts.take<std::uint32_t>(kGapEntryRoom),
                           parts.take<std::uint32_t>(kGapEntryRoom),
                           parts.take<double>(kGapEntryRoom), parts.take<double>(kGapEntryRoom)};
    pairs.entry_room = kGapEntryRoom;
    pairs.measure = Measure::inner;
    return parts.used();
  }
};

GpuWorkspace::GpuWorkspace(std::size_t most_pairs, const GpuSettings& settings)
    : impl_(std::make_unique<Impl>()) {
  gpu_info(settings.device);
  if (most_pairs > 0xFFFFFFFFu) throw Error("GPU: a batch holds up to 2^32 - 1 pairs: divide it");
  gpu::Queue queue(settings);
  impl_->device = settings.device;
  impl_->most_pairs = most_pairs;
  impl_->grids = gpu::batch_grids();
  impl_->separation_grids = gpu::separation_grids();
  impl_->memory = DeviceBytes(queue, settings, impl_->place(nullptr));
  impl_->place(impl_->memory.data());
  queue.wait();
}

GpuWorkspace::~GpuWorkspace() = default;
GpuWorkspace::GpuWorkspace(GpuWorkspace&&) noexcept = default;
GpuWorkspace& GpuWorkspace::operator=(GpuWorkspace&&) noexcept = default;

std::size_t GpuWorkspace::most_pairs() const noexcept { return impl_->most_pairs; }
std::size_t GpuWorkspace::bytes() const noexcept { return impl_->memory.bytes(); }

namespace {

/// Throws where a batch does not fit.
void check_batch(const GpuAssets& assets, const GpuPairs& pairs, const GpuWorkspace::Impl& room) {
  if (pairs.count > room.most_pairs)
    throw Error("GPU: a batch of " + std::to_string(pairs.count) + " pairs; the workspace is for " +
                std::to_string(room.most_pairs));
  if (assets.device() != room.device)
    throw Error("GPU: the assets are on device " + std::to_string(assets.device()) +
                ", the workspace on " + std::to_string(room.device));
}

void set_pairs(const GpuAssets::Impl& assets, const GpuPairs& pairs, gpu::BatchArrays& batch) {
  batch.assets = assets.refs;
  batch.asset_count = static_cast<std::uint32_t>(assets.size);
  batch.pairs = pairs;
}

}  // namespace

void penetration_batch(const GpuAssets& assets, const GpuPairs& pairs, Measure measure,
                       GpuWorkspace& workspace, const GpuPenetrations& answers,
                       CUstream_st* stream) {
  const GpuWorkspace::Impl& room = workspace.impl();
  check_batch(assets, pairs, room);
  if (pairs.count == 0) return;
  gpu::BatchArrays batch = room.arrays;
  set_pairs(assets.impl(), pairs, batch);
  batch.measure = measure;
  batch.answers = answers;
  const gpu::DeviceGuard guard(room.device);
  gpu::launch_batch(batch, room.grids, stream);
}

void separation_batch(const GpuAssets& assets, const GpuPairs& pairs, std::uint32_t max_visits,
                      GpuWorkspace& workspace, const GpuSeparations& answers, CUstream_st* stream) {
  const GpuWorkspace::Impl& room = workspace.impl();
  check_batch(assets, pairs, room);
  if (pairs.count == 0) return;
  gpu::SeparationArrays batch = room.separations;
  set_pairs(assets.impl(), pairs, batch.pairs);
  batch.answers = answers;
  batch.max_visits = max_visits == 0 ? ~0u : max_visits;
  const gpu::DeviceGuard guard(room.device);
  gpu::launch_separations(batch, room.separation_grids, stream);
}

}  // namespace ist
