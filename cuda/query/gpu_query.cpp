#include <ist/gpu_query.h>

#include <ist/types.h>

#include <algorithm>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cuda/base/check.h"
#include "cuda/query/gpu_solids.h"
#include "cuda/query/kernels.h"
#include "cuda/query/make_solid_ref.h"
#include "cuda/query/parts.h"

namespace ist {

struct GpuWorkspace::Impl {
  int device = 0;
  std::size_t most_pairs = 0;
  gpu::Grids grids{};
  gpu::DeviceBytes memory;
  // The constant parts of batches. All kinds of batches share the same memory.
  gpu::BatchArrays arrays{};
  gpu::SeparationArrays separations{};
  gpu::PatchArrays patches{};
  gpu::ExactArrays exact{};
  std::size_t patch_bytes = 0;  ///< [bytes] at patches.rooms
  gpu::FieldCounters* field_counters = nullptr;
  gpu::TriangleWorkspace triangle_work{};
};

namespace {

/// Capacities for split pairs. A batch that needs more is answered too, more slowly.
constexpr std::uint32_t kSplitCapacity = 1 << 16, kTaskCapacity = 1 << 19, kEntryCapacity = 1 << 21;
constexpr std::uint32_t kQueryCapacity = 1 << 16, kPartCapacity = 1 << 17, kWordCapacity = 3 << 22;
/// Capacities of a round of pairs of meshes, and their chunks of triangles.
constexpr std::uint32_t kMeshCapacity = 1 << 15, kChunksEach = 64, kMostChunks = 1 << 19;
constexpr std::uint32_t kMeshGapCapacity = 1 << 17;   ///< a round of distances of meshes
constexpr std::uint32_t kGapEntryCapacity = 1 << 20;  ///< of separations, whose entries are larger

}  // namespace

GpuSolids::GpuSolids(std::span<const GpuSolid> solids, const GpuSettings& settings)
    : impl_(new Impl) {
  gpu::check_gpu(settings.device);
  gpu::Queue queue(settings);
  std::vector<gpu::SolidRef> refs(solids.size());
  gpu::SolidRef* at = nullptr;
  // This runs twice: first for the sizes, then for the arrays.
  const auto place = [&](std::byte* from) {
    gpu::Parts parts(from);
    at = parts.take<gpu::SolidRef>(solids.size());
    const auto put = [&](const auto& array) {
      const std::span all(array);
      using T = typename decltype(all)::value_type;
      auto* const to = parts.take<T>(all.size());
      if (from != nullptr) gpu::copy_to_device<T>(to, all, queue);
      return static_cast<const T*>(to);
    };
    for (std::size_t i = 0; i < solids.size(); ++i) refs[i] = gpu::solid_ref(solids, i, put);
    return parts.used();
  };
  impl_->device = settings.device;
  impl_->size = solids.size();
  impl_->memory = gpu::DeviceBytes(queue, settings, place(nullptr));
  place(impl_->memory.data());
  gpu::copy_to_device<gpu::SolidRef>(at, refs, queue);
  impl_->refs = at;
  for (const GpuSolid& solid : solids)
    impl_->boxes.push_back(std::visit([](const auto& s) { return solid_box(s); }, solid));
  for (const gpu::SolidRef& solid : refs) {
    if (solid.is_field()) impl_->has_group[gpu::group_of(solid.field.kind)] = true;
    impl_->has_fields = impl_->has_fields || solid.is_field();
    impl_->has_details = impl_->has_details || solid.details.coarser > 0;
    for (const gpu::CutsRef& cuts : solid.cuts)
      impl_->most_bins = std::max(impl_->most_bins, cuts.bins);
    impl_->most_blocks = std::max(impl_->most_blocks, solid.mesh.count);
    impl_->all_meshes = impl_->all_meshes && (solid.is_field() || solid.mesh.header != nullptr);
  }
  queue.wait();
}

std::size_t GpuSolids::size() const noexcept { return impl_->size; }
std::size_t GpuSolids::bytes() const noexcept { return impl_->memory.bytes(); }
int GpuSolids::device() const noexcept { return impl_->device; }

namespace {

void place_splits(gpu::Parts& parts, gpu::BatchArrays& batch) {
  batch.splits = parts.take<gpu::SplitPair>(kSplitCapacity);
  batch.tasks = parts.take<gpu::PairTask>(kTaskCapacity);
  batch.split_capacity = kSplitCapacity;
  batch.task_capacity = kTaskCapacity;
}

/// Memory for pairs with triangles. Trees in fields use the lists of place_penetrations(), but not
/// its other memory.
std::size_t place_triangle_work(std::byte* from, gpu::TriangleWorkspace& work) {
  gpu::Parts parts(from);
  work.queries = parts.take<gpu::TriangleQuery>(kQueryCapacity);
  work.parts = parts.take<gpu::MetPart>(kPartCapacity);
  work.words = parts.take<std::uint32_t>(kWordCapacity);
  work.query_capacity = kQueryCapacity;
  work.part_capacity = kPartCapacity;
  work.word_capacity = kWordCapacity;
  return parts.used();
}

std::size_t place_penetrations(std::byte* from, GpuWorkspace::Impl& work) {
  gpu::Parts parts(from);
  gpu::BatchArrays& arrays = work.arrays;
  arrays.counters = parts.take<gpu::BatchCounters>(1);
  work.field_counters = parts.take<gpu::FieldCounters>(1);
  const std::size_t sizes = arrays.size_capacity > 0 ? gpu::kSizes : 1;
  arrays.list = parts.take<std::uint32_t>(sizes * work.most_pairs);
  arrays.detailed = parts.take<std::uint32_t>(work.most_pairs);
  const std::size_t lists = parts.used();
  const std::size_t triangles = place_triangle_work(from + lists, work.triangle_work);
  place_splits(parts, arrays);
  arrays.places = parts.take<PairPlace>(kSplitCapacity);
  arrays.totals = parts.take<gpu::LensTotals>(kSplitCapacity + kTaskCapacity);
  arrays.entries_a = parts.take<std::uint32_t>(kEntryCapacity);
  arrays.entries_b = parts.take<std::uint32_t>(kEntryCapacity);
  arrays.entry_capacity = kEntryCapacity;
  return std::max(parts.used(), lists + triangles);
}

std::size_t place_separations(std::byte* from, GpuWorkspace::Impl& work) {
  gpu::Parts parts(from);
  gpu::SeparationArrays& arrays = work.separations;
  arrays.counters = parts.take<gpu::BatchCounters>(3);
  for (std::uint32_t*& list : arrays.list) list = parts.take<std::uint32_t>(work.most_pairs);
  arrays.meshes.query_capacity =
      static_cast<std::uint32_t>(std::min<std::size_t>(work.most_pairs, kMeshGapCapacity));
  arrays.meshes.rounds = parts.take<gpu::MeshGapRound>(2);
  std::byte* const shared = from + parts.used();
  arrays.meshes.queries = parts.take<gpu::MeshGapQuery>(arrays.meshes.query_capacity);
  const std::size_t of_meshes = parts.used();
  // Sphere searches use the same memory, since they are done before.
  parts = gpu::Parts(shared);
  place_splits(parts, arrays.pairs);
  arrays.totals = parts.take<gpu::GapTotals>(kSplitCapacity + kTaskCapacity);
  arrays.entries = {parts.take<std::uint32_t>(kGapEntryCapacity),
                    parts.take<std::uint32_t>(kGapEntryCapacity),
                    parts.take<double>(kGapEntryCapacity), parts.take<double>(kGapEntryCapacity)};
  arrays.pairs.entry_capacity = kGapEntryCapacity;
  return std::max(of_meshes, static_cast<std::size_t>(shared - from) + parts.used());
}

/// The teams' memory takes the rest of `bytes`.
void place_patches(std::byte* from, std::size_t bytes, GpuWorkspace::Impl& work) {
  gpu::Parts parts(from);
  gpu::PatchArrays& arrays = work.patches;
  arrays.pairs.counters = parts.take<gpu::BatchCounters>(1);
  arrays.pairs.list = parts.take<std::uint32_t>(work.most_pairs);
  work.patch_bytes = bytes - parts.used();
  arrays.team_memory = from + parts.used();
}

/// The teams' memory takes the rest of `bytes`. Returns the bytes with which all teams have some.
std::size_t place_exact(std::byte* from, std::size_t bytes, GpuWorkspace::Impl& work) {
  gpu::Parts parts(from);
  gpu::ExactArrays& exact = work.exact;
  exact.counters = parts.take<gpu::ExactCounters>(1);
  for (std::uint32_t*& list : exact.list) list = parts.take<std::uint32_t>(work.most_pairs);
  exact.memory = from + parts.used();
  exact.bytes = bytes - parts.used();
  exact.query_capacity =
      static_cast<std::uint32_t>(std::min<std::size_t>(work.most_pairs, kMeshCapacity));
  exact.pool.capacity = 1024 + std::min(kChunksEach * exact.query_capacity, kMostChunks);
  exact.queries = parts.take<gpu::ExactQuery>(exact.query_capacity);
  exact.pool.chunks = parts.take<gpu::ExactChunk>(exact.pool.capacity);
  exact.pool.next = parts.take<std::uint32_t>(exact.pool.capacity);
  exact.team_memory = from + parts.used();
  return parts.used() + gpu::exact_memory_bytes(work.grids, work.most_pairs);
}

/// Sets the workspace's arrays to parts of the memory at `from`, and returns the bytes they take.
/// All kinds of batches share the memory except for flags, which are 0 between batches.
std::size_t place(std::byte* from, GpuWorkspace::Impl& work) {
  work.arrays.cut_for(work.most_pairs);
  gpu::Parts flags(from);
  work.arrays.posted = flags.take<std::uint32_t>(kTaskCapacity);
  std::byte* const shared = from + flags.used();
  const std::size_t bytes =
      std::max({place_penetrations(shared, work), place_separations(shared, work),
                place_exact(shared, 0, work)});
  place_patches(shared, bytes, work);
  place_exact(shared, bytes, work);
  return flags.used() + bytes;
}

}  // namespace

GpuWorkspace::GpuWorkspace(std::size_t most_pairs, const GpuSettings& settings) : impl_(new Impl) {
  gpu::check_gpu(settings.device);
  if (most_pairs > 0xFFFFFFFFu) throw Error("GPU: a batch holds up to 2^32 - 1 pairs: divide it");
  gpu::Queue queue(settings);
  impl_->device = settings.device;
  impl_->most_pairs = most_pairs;
  gpu::find_batch_grids(impl_->grids);
  gpu::find_separation_grids(impl_->grids);
  gpu::find_patch_grids(impl_->grids);
  gpu::find_field_grids(impl_->grids);
  gpu::find_exact_grids(impl_->grids);
  gpu::find_exact_patch_grids(impl_->grids);
  impl_->memory = gpu::DeviceBytes(queue, settings, place(nullptr, *impl_));
  place(impl_->memory.data(), *impl_);
  gpu::check(cudaMemsetAsync(impl_->arrays.posted, 0, kTaskCapacity * sizeof(std::uint32_t),
                             queue.stream()),
             "readying a workspace");
  queue.wait();
}

std::size_t GpuWorkspace::most_pairs() const noexcept { return impl_->most_pairs; }
std::size_t GpuWorkspace::bytes() const noexcept { return impl_->memory.bytes(); }

struct GpuKept::Impl {
  int device = 0;
  gpu::DeviceBytes memory;
  gpu::ExactKept arrays{};
};

GpuKept::GpuKept(std::size_t most_pairs, std::size_t bytes_each, const GpuSettings& settings)
    : impl_(new Impl) {
  gpu::check_gpu(settings.device);
  if (most_pairs > 0xFFFFFFFFu || bytes_each < 1024 || bytes_each > 1 << 24)
    throw Error("GPU: what is kept is for up to 2^32 - 1 pairs, with 1,024 to 2^24 bytes each");
  gpu::Queue queue(settings);
  gpu::ExactKept& arrays = impl_->arrays;
  arrays.pairs = static_cast<std::uint32_t>(most_pairs);
  arrays.bytes = static_cast<std::uint32_t>((bytes_each + 127) / 128 * 128);
  const auto place = [&](std::byte* from) {
    gpu::Parts parts(from);
    arrays.rounds = parts.take<gpu::KeptRound>(2);
    arrays.list = parts.take<std::uint32_t>(std::min<std::size_t>(most_pairs, kMeshCapacity));
    arrays.memory = parts.take<std::byte>(most_pairs * arrays.bytes);
    return parts.used();
  };
  impl_->device = settings.device;
  impl_->memory = gpu::DeviceBytes(queue, settings, place(nullptr));
  place(impl_->memory.data());
  gpu::check(cudaMemsetAsync(impl_->memory.data(), 0, impl_->memory.bytes(), queue.stream()),
             "readying what is kept");
  queue.wait();
}

std::size_t GpuKept::most_pairs() const noexcept { return impl_->arrays.pairs; }
std::size_t GpuKept::bytes() const noexcept { return impl_->memory.bytes(); }

namespace {

/// Checks the arguments of a batch of any kind, and throws if it cannot be launched.
gpu::SolidPairs asked_of(const GpuSolids& solids, const GpuPairs& pairs,
                         const GpuWorkspace::Impl& work, Measure measure,
                         const GpuPenetrations& answers) {
  if (measure > Measure::exact) throw Error("GPU: a measure that has no name");
  if (pairs.count > work.most_pairs)
    throw Error("GPU: a batch of " + std::to_string(pairs.count) + " pairs; the workspace is for " +
                std::to_string(work.most_pairs));
  if (solids.device() != work.device)
    throw Error("GPU: the solids are on device " + std::to_string(solids.device()) +
                ", the workspace on " + std::to_string(work.device));
  return {solids.impl().refs, static_cast<std::uint32_t>(solids.size()), measure, pairs, answers};
}

/// Throws if the workspace is too small for the largest mesh.
template <class Arrays>
Arrays exact_batch(const GpuSolids& solids, const GpuWorkspace::Impl& work,
                   const gpu::SolidPairs& asked) {
  Arrays batch = {};
  static_cast<gpu::ExactArrays&>(batch) = work.exact;
  static_cast<gpu::SolidPairs&>(batch) = asked;
  batch.most_blocks = solids.impl().most_blocks;
  if (!gpu::has_memory(batch))
    throw Error("GPU: the largest mesh does not fit into a workspace for the exact measure");
  return batch;
}

}  // namespace

void penetration_batch(const GpuSolids& solids, const GpuPairs& pairs,
                       const GpuPenetrationSettings& settings, GpuWorkspace& workspace,
                       const GpuPenetrations& answers, CUstream_st* stream) {
  const GpuWorkspace::Impl& work = workspace.impl();
  const gpu::SolidPairs asked = asked_of(solids, pairs, work, settings.measure, answers);
  if (pairs.count == 0) return;
  if (settings.measure == Measure::exact) {
    const auto batch = exact_batch<gpu::ExactArrays>(solids, work, asked);
    const gpu::ExactKept* kept = nullptr;
    if (settings.kept != nullptr) {
      kept = &settings.kept->impl().arrays;
      if (pairs.count > kept->pairs)
        throw Error("GPU: a batch of " + std::to_string(pairs.count) +
                    " pairs; what is kept is for " + std::to_string(kept->pairs));
      if (settings.kept->impl().device != work.device)
        throw Error("GPU: what is kept is on another device than the workspace");
    }
    const gpu::DeviceGuard guard(work.device);
    gpu::launch_exact(batch, kept, work.grids, stream);
    return;
  }
  gpu::BatchArrays batch = work.arrays;
  static_cast<gpu::SolidPairs&>(batch) = asked;
  batch.pair_budget = settings.pair_budget;
  batch.has_details = solids.impl().has_details;
  const gpu::DeviceGuard guard(work.device);
  gpu::launch_batch(batch, work.grids, stream);
  if (!solids.impl().has_fields) return;
  // Pairs with fields use the same memory once the trees are done.
  const gpu::FieldBatch fields = {
      asked, work.field_counters, {work.arrays.list, work.arrays.detailed}, work.triangle_work};
  gpu::launch_field_batch(fields, solids.impl().has_group, work.grids, stream);
}

void separation_batch(const GpuSolids& solids, const GpuPairs& pairs,
                      const GpuSeparationSettings& settings, GpuWorkspace& workspace,
                      const GpuSeparations& answers, CUstream_st* stream) {
  const GpuWorkspace::Impl& work = workspace.impl();
  const gpu::SolidPairs asked = asked_of(solids, pairs, work, Measure::inner, {});
  if (pairs.count == 0) return;
  if (!(settings.max_distance >= 0)) throw Error("GPU: max_distance is not a number ≥ 0");
  gpu::SeparationArrays batch = work.separations;
  static_cast<gpu::SolidPairs&>(batch.pairs) = asked;
  batch.answers = answers;
  batch.max_visits = settings.max_visits == 0 ? ~0u : settings.max_visits;
  batch.max_distance = settings.max_distance;
  const gpu::DeviceGuard guard(work.device);
  gpu::launch_separations(batch, work.grids, !solids.impl().all_meshes,
                          solids.impl().most_blocks > 0, stream);
}

void contact_patches_batch(const GpuSolids& solids, const GpuPairs& pairs, Measure measure,
                           GpuWorkspace& workspace, const GpuPenetrations& answers,
                           const GpuContactPatches& patches, CUstream_st* stream) {
  const GpuWorkspace::Impl& work = workspace.impl();
  const gpu::SolidPairs asked = asked_of(solids, pairs, work, measure, answers);
  if (patches.most > kMostGpuPatches)
    throw Error("GPU: " + std::to_string(patches.most) + " patches a pair; at most " +
                std::to_string(kMostGpuPatches));
  if (pairs.count == 0) return;
  const gpu::DeviceGuard guard(work.device);
  if (measure == Measure::exact) {
    auto batch = exact_batch<gpu::ExactPatchArrays>(solids, work, asked);
    batch.patches = patches;
    gpu::launch_exact_patches(batch, work.grids, stream);
    return;
  }
  gpu::PatchArrays batch = work.patches;
  static_cast<gpu::SolidPairs&>(batch.pairs) = asked;
  batch.patches = patches;
  batch.most_bins = solids.impl().most_bins;
  gpu::launch_patches(batch, work.grids, work.patch_bytes, stream);
}

}  // namespace ist
