#include "cuda/packing/grids/device_grid.h"

#include <ist/types.h>

#include <algorithm>
#include <span>

#include "cuda/base/check.h"
#include "cuda/base/device_array.h"
#include "packing/grids/cell_listing.h"
#include "packing/grids/distance_grid.h"

namespace ist::gpu {
namespace {

/// The words of a distance grid, mutable.
struct GridWords {
  std::uint32_t* words = nullptr;
  const std::uint32_t* keys = nullptr;  ///< nullptr: not hashed
  std::uint32_t key_mask = 0;

  /// nullptr if the cell is not active.
  __device__ std::uint32_t* find(std::uint32_t cell) const {
    using packing::DistanceGrid;
    std::uint32_t at = cell;
    if (keys != nullptr) {
      at = DistanceGrid::hashed(cell) & key_mask;
      while (keys[at] != cell) {
        if (keys[at] == DistanceGrid::kEmptyKey) return nullptr;
        at = (at + 1) & key_mask;
      }
    }
    return words[at] == DistanceGrid::kInactive ? nullptr : words + at;
  }
};

using packing::CellRange;
using packing::CellRecord;
using packing::DistanceGrid;
using packing::GridLayout;
using packing::GridScene;

constexpr unsigned kThreads = 128;

__device__ unsigned global_thread() { return blockIdx.x * kThreads + threadIdx.x; }

/// Calls act(cell, covered) for the cells that a sphere meets or covers, one block a sphere.
template <class Act>
__device__ void for_sphere_cells(const GridLayout& g, const Sphere& s, bool covered_too,
                                 const Act& act) {
  const CellRange range = packing::sphere_range(g, s);
  const int ny = range.hi[1] - range.lo[1] + 1, nz = range.hi[2] - range.lo[2] + 1;
  for (int n = static_cast<int>(threadIdx.x); n < ny * nz; n += static_cast<int>(blockDim.x))
    packing::for_sphere_row(g, s, range, range.lo[1] + n % ny, range.lo[2] + n / ny, covered_too,
                            act);
}

__global__ void cover_cells(const GridLayout g, const Sphere* spheres, std::uint32_t first,
                            std::uint32_t end, GridWords words, std::uint32_t* covered_count) {
  for (std::uint32_t n = first + blockIdx.x; n < end; n += gridDim.x)
    for_sphere_cells(g, spheres[n], true, [&](std::uint32_t cell, bool covered) {
      if (!covered) return;
      std::uint32_t* const word = words.find(cell);
      if (word == nullptr) return;
      *word = DistanceGrid::kInactive;
      atomicAdd(covered_count, 1u);
    });
}

/// Counts if `lists` is null, else fills.
__global__ void list_spheres_of(const GridLayout g, const Sphere* spheres, std::uint32_t end,
                                GridWords words, CellRecord* records, std::uint32_t* lists) {
  for (std::uint32_t n = blockIdx.x; n < end; n += gridDim.x)
    for_sphere_cells(g, spheres[n], false, [&](std::uint32_t cell, bool) {
      const std::uint32_t* const word = words.find(cell);
      if (word == nullptr) return;
      CellRecord& record = records[DistanceGrid::slot(*word)];
      const std::uint32_t place = atomicAdd(&record.sphere_count, 1u);
      if (lists != nullptr) lists[record.spheres + place] = n;
    });
}

__global__ void flag_active_cells(const std::uint32_t* words, std::uint32_t count,
                                  std::uint32_t* flags) {
  const unsigned c = global_thread();
  if (c <= count) flags[c] = c < count && words[c] != DistanceGrid::kInactive ? 1 : 0;
}

__global__ void make_records(std::uint32_t cells, const std::uint32_t* slots,
                             const std::uint32_t* triangles, const std::int32_t* windings,
                             std::uint32_t* words, CellRecord* records) {
  const unsigned c = global_thread();
  if (c >= cells || words[c] == DistanceGrid::kInactive) return;
  words[c] = slots[c];
  records[slots[c]] = {c, triangles[c], triangles[c + 1] - triangles[c], 0, 0, windings[c]};
}

__global__ void flag_active_records(const CellRecord* records, std::uint32_t count, GridWords words,
                                    std::uint32_t* flags) {
  const unsigned r = global_thread();
  if (r <= count) flags[r] = r < count && words.find(records[r].cell) != nullptr ? 1 : 0;
}

__global__ void move_records(const CellRecord* from, std::uint32_t count,
                             const std::uint32_t* places, GridWords words, CellRecord* to) {
  const unsigned r = global_thread();
  if (r >= count || places[r + 1] == places[r]) return;
  to[places[r]] = from[r];
  *words.find(from[r].cell) = places[r];
}

__global__ void hash_records(const CellRecord* records, std::uint32_t count, std::uint32_t* keys,
                             std::uint32_t* words, std::uint32_t mask) {
  const unsigned r = global_thread();
  if (r >= count) return;
  const std::uint32_t cell = records[r].cell;
  std::uint32_t at = DistanceGrid::hashed(cell) & mask;
  while (atomicCAS(keys + at, DistanceGrid::kEmptyKey, cell) != DistanceGrid::kEmptyKey)
    at = (at + 1) & mask;
  words[at] = r;
}

__global__ void clear_sphere_counts(CellRecord* records, std::uint32_t count) {
  const unsigned r = global_thread();
  if (r < count) records[r].sphere_count = 0;
}

__global__ void take_sphere_counts(const CellRecord* records, std::uint32_t count,
                                   std::uint32_t* counts) {
  const unsigned r = global_thread();
  if (r <= count) counts[r] = r < count ? records[r].sphere_count : 0;
}

__global__ void place_sphere_lists(CellRecord* records, std::uint32_t count,
                                   const std::uint32_t* begins) {
  const unsigned r = global_thread();
  if (r >= count) return;
  records[r].spheres = begins[r];
  records[r].sphere_count = 0;
}

__global__ void start_field(const CellRecord* records, std::uint32_t count, GridWords words,
                            std::uint8_t* field) {
  const unsigned r = global_thread();
  if (r < count && words.find(records[r].cell) != nullptr)
    field[records[r].cell] = packing::start_distance(records[r]);
}

__global__ void sweep_field(const GridLayout g, int axis, std::uint8_t* field) {
  const unsigned n = global_thread();
  if (n < static_cast<unsigned>(packing::grid_lines(g, axis)))
    packing::sweep_line(field, packing::grid_line(g, axis, static_cast<int>(n)));
}

__global__ void take_field(const CellRecord* records, std::uint32_t count, GridWords words,
                           const std::uint8_t* field) {
  const unsigned r = global_thread();
  if (r >= count) return;
  std::uint32_t* const word = words.find(records[r].cell);
  if (word != nullptr)
    *word = DistanceGrid::slot(*word) | std::uint32_t{field[records[r].cell]} << 24;
}

GridWords words_of(const DeviceArray<std::uint32_t>& words,
                   const DeviceArray<std::uint32_t>& keys) {
  if (keys.size() == 0) return {words.data()};
  return {words.data(), keys.data(), static_cast<std::uint32_t>(keys.size() - 1)};
}

}  // namespace

DeviceGrid::DeviceGrid(Queue& queue, const MeshView& mesh)
    : queue_(&queue),
      triangle_count_(mesh.triangle_count),
      vertices_(queue, 3 * std::size_t{mesh.vertex_count}),
      corners_(queue, 3 * std::size_t{mesh.triangle_count}),
      triangles_(queue, mesh.triangle_count),
      counter_(queue, 1) {
  vertices_.upload(std::span(mesh.vertices, vertices_.size()));
  corners_.upload(std::span(mesh.triangles, corners_.size()));
  prepare_triangles(queue, vertices_, corners_, triangles_);
}

GridScene DeviceGrid::scene() const {
  GridScene scene;
  scene.grid = {layout_,
                words_.data(),
                hashed() ? keys_.data() : nullptr,
                static_cast<std::uint32_t>(hashed() ? keys_.size() - 1 : 0),
                records_.data(),
                triangle_lists_.data(),
                sphere_lists_.data()};
  scene.triangles = triangles_.data();
  scene.corners = corners_.data();
  scene.vertices = vertices_.data();
  scene.spheres = spheres_.data();
  return scene;
}

void DeviceGrid::append(const Sphere* spheres, std::size_t count) {
  if (sphere_count_ + count > spheres_.size()) {
    const std::size_t capacity =
        std::max<std::size_t>({1024, 2 * spheres_.size(), sphere_count_ + count});
    if (spheres_.size() == 0) {
      spheres_ = DeviceArray<Sphere>(*queue_, capacity);
    } else {
      spheres_.grow(capacity, sphere_count_);
    }
  }
  check(cudaMemcpyAsync(spheres_.data() + sphere_count_, spheres, count * sizeof(Sphere),
                        cudaMemcpyHostToDevice, queue_->stream()),
        "copying spheres to the GPU");
  sphere_count_ += count;
}

void DeviceGrid::build(const GridLayout& layout) {
  const cudaStream_t stream = queue_->stream();
  layout_ = layout;
  const std::uint32_t cells = layout.count();
  words_.release();
  keys_.release();
  records_.release();
  triangle_lists_.release();
  sphere_lists_.release();
  words_ = DeviceArray<std::uint32_t>(*queue_, cells);
  DeviceArray<std::uint32_t> counts(*queue_, std::size_t{cells} + 1);
  DeviceArray<std::int32_t> windings(*queue_, cells);
  DeviceArray<std::uint32_t> large(*queue_, triangle_count_);
  counter_.fill_bytes(0);
  const GridScene mesh = scene();
  count_triangles(*queue_, mesh, layout, triangle_count_, counts, windings, large);
  classify_rows(*queue_, layout, counts, windings, words_);
  cover(0);

  DeviceArray<std::uint32_t> slots(*queue_, std::size_t{cells} + 1);
  launch("listing cells", flag_active_cells, blocks_for(std::size_t{cells} + 1, kThreads), kThreads,
         stream, words_.data(), cells, slots.data());
  exclusive_sum(*queue_, slots);
  exclusive_sum(*queue_, counts);
  const std::uint32_t active = slots.at(cells), listed = counts.at(cells);
  if (active > DistanceGrid::kMostActive)
    throw Error("packing: more than 16 million active grid cells: set a smaller grid resolution");
  active_ = active;
  records_ = DeviceArray<CellRecord>(*queue_, active);
  triangle_lists_ = DeviceArray<std::uint32_t>(*queue_, listed);
  launch("listing cells", make_records, blocks_for(cells, kThreads), kThreads, stream, cells,
         slots.data(), counts.data(), windings.data(), words_.data(), records_.data());
  slots.release();
  fill_triangle_lists(*queue_, mesh, layout, triangle_count_, words_, records_, windings, large,
                      triangle_lists_);
  counts.release();
  windings.release();
  large.release();
  hash_words();
  list_spheres();
  measure_distances();
}

void DeviceGrid::update() {
  counter_.fill_bytes(0);
  cover(listed_);
  drop_inactive();
  list_spheres();
  measure_distances();
}

/// Adds the cells that become inactive to the counter.
void DeviceGrid::cover(std::size_t first_new) {
  if (sphere_count_ > first_new) {
    const auto most = static_cast<std::size_t>(64 * queue_->multiprocessors());
    const GridWords words = words_of(words_, keys_);
    launch("covering cells", cover_cells, std::min(most, sphere_count_ - first_new), kThreads,
           queue_->stream(), layout_, spheres_.data(), static_cast<std::uint32_t>(first_new),
           static_cast<std::uint32_t>(sphere_count_), words, counter_.data());
  }
  listed_ = sphere_count_;
}

void DeviceGrid::drop_inactive() {
  active_ -= counter_.at(0);
  const std::size_t count = records_.size();
  if (8 * (count - active_) < count) return;
  const cudaStream_t stream = queue_->stream();
  const GridWords words = words_of(words_, keys_);
  DeviceArray<std::uint32_t> places(*queue_, count + 1);
  launch("giving cells back", flag_active_records, blocks_for(count + 1, kThreads), kThreads,
         stream, records_.data(), static_cast<std::uint32_t>(count), words, places.data());
  exclusive_sum(*queue_, places);
  DeviceArray<CellRecord> kept(*queue_, active_);
  launch("giving cells back", move_records, blocks_for(count, kThreads), kThreads, stream,
         records_.data(), static_cast<std::uint32_t>(count), places.data(), words, kept.data());
  records_ = std::move(kept);
  hash_words();
}

void DeviceGrid::hash_words() {
  if (!packing::hash_pays(layout_.count(), records_.size())) return;
  const std::size_t size = packing::hash_size(records_.size());
  keys_ = DeviceArray<std::uint32_t>(*queue_, size);
  words_ = DeviceArray<std::uint32_t>(*queue_, size);
  keys_.fill_bytes(0xFF);
  words_.fill_bytes(0xFF);
  launch("hashing cells", hash_records, blocks_for(records_.size(), kThreads), kThreads,
         queue_->stream(), records_.data(), static_cast<std::uint32_t>(records_.size()),
         keys_.data(), words_.data(), static_cast<std::uint32_t>(size - 1));
}

void DeviceGrid::list_spheres() {
  const auto count = static_cast<std::uint32_t>(records_.size());
  const auto spheres = static_cast<std::uint32_t>(sphere_count_);
  if (count == 0) return;
  const cudaStream_t stream = queue_->stream();
  const GridWords words = words_of(words_, keys_);
  const auto list = [&](std::uint32_t* lists) {
    if (spheres == 0) return;
    const auto most = static_cast<unsigned>(64 * queue_->multiprocessors());
    launch("listing spheres", list_spheres_of, std::min(most, spheres), kThreads, stream, layout_,
           spheres_.data(), spheres, words, records_.data(), lists);
  };
  launch("listing spheres", clear_sphere_counts, blocks_for(count, kThreads), kThreads, stream,
         records_.data(), count);
  list(nullptr);
  DeviceArray<std::uint32_t> begins(*queue_, std::size_t{count} + 1);
  launch("listing spheres", take_sphere_counts, blocks_for(std::size_t{count} + 1, kThreads),
         kThreads, stream, records_.data(), count, begins.data());
  exclusive_sum(*queue_, begins);
  sphere_lists_.release();
  sphere_lists_ = DeviceArray<std::uint32_t>(*queue_, begins.at(count));
  launch("listing spheres", place_sphere_lists, blocks_for(count, kThreads), kThreads, stream,
         records_.data(), count, begins.data());
  list(sphere_lists_.data());
}

void DeviceGrid::measure_distances() {
  const auto count = static_cast<std::uint32_t>(records_.size());
  if (count == 0) return;
  const cudaStream_t stream = queue_->stream();
  const GridWords words = words_of(words_, keys_);
  DeviceArray<std::uint8_t> field(*queue_, layout_.count());
  field.fill_bytes(packing::kInactiveCell);
  launch("measuring discrete distances", start_field, blocks_for(count, kThreads), kThreads, stream,
         records_.data(), count, words, field.data());
  for (int axis = 0; axis < 3; ++axis)
    launch("measuring discrete distances", sweep_field,
           blocks_for(static_cast<std::size_t>(packing::grid_lines(layout_, axis)), kThreads),
           kThreads, stream, layout_, axis, field.data());
  launch("measuring discrete distances", take_field, blocks_for(count, kThreads), kThreads, stream,
         records_.data(), count, words, field.data());
}

}  // namespace ist::gpu
