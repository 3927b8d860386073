#include "bake/surface/vertex_clusters.h"

#include <tbb/concurrent_vector.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "mesh/exact_triangle.h"

namespace ist {
namespace {

/// How strongly the mean of a cluster's corners holds it where planes do not.
constexpr double kPull = 1e-3;

/// Solves the symmetric positive definite system a x = b.
void solve(const double a[3][3], const double b[3], double x[3]) {
  const double c00 = a[1][1] * a[2][2] - a[1][2] * a[1][2];
  const double c01 = a[0][2] * a[1][2] - a[0][1] * a[2][2];
  const double c02 = a[0][1] * a[1][2] - a[0][2] * a[1][1];
  const double c11 = a[0][0] * a[2][2] - a[0][2] * a[0][2];
  const double c12 = a[0][1] * a[0][2] - a[0][0] * a[1][2];
  const double c22 = a[0][0] * a[1][1] - a[0][1] * a[0][1];
  const double determinant = a[0][0] * c00 + a[0][1] * c01 + a[0][2] * c02;
  x[0] = (c00 * b[0] + c01 * b[1] + c02 * b[2]) / determinant;
  x[1] = (c01 * b[0] + c11 * b[1] + c12 * b[2]) / determinant;
  x[2] = (c02 * b[0] + c12 * b[1] + c22 * b[2]) / determinant;
}

/// Numbers cells in the order in which they are first asked for.
class CellNumbers {
 public:
  using Cell = std::array<std::int32_t, 3>;

  std::uint32_t of(const Cell& cell) {
    if (2 * (std::size_t{count_} + 1) > slots_.size()) grow();
    Slot& slot = slots_[place(cell)];
    if (slot.number == kNone) slot = {cell, count_++};
    return slot.number;
  }
  std::uint32_t count() const { return count_; }

 private:
  static constexpr std::uint32_t kNone = ~0u;
  struct Slot {
    Cell cell;
    std::uint32_t number = kNone;
  };

  /// Where the cell is or goes.
  std::size_t place(const Cell& cell) const {
    std::uint64_t hash = 0;
    for (const std::int32_t x : cell)
      hash = (hash ^ static_cast<std::uint32_t>(x)) * 0x9E3779B97F4A7C15u;
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = (hash ^ hash >> 32) & mask;
    while (slots_[at].number != kNone && slots_[at].cell != cell) at = (at + 1) & mask;
    return at;
  }

  void grow() {
    std::vector<Slot> old(std::max<std::size_t>(1024, 4 * slots_.size()));
    old.swap(slots_);
    for (const Slot& slot : old)
      if (slot.number != kNone) slots_[place(slot.cell)] = slot;
  }

  std::vector<Slot> slots_;
  std::uint32_t count_ = 0;
};

/// Where the grid lies, in cells: off the planes that meshes like.
constexpr double kShift[3] = {0.3711, 0.4393, 0.2937};
constexpr std::uint32_t kOpen = ~0u;  ///< no cluster, no vertex
constexpr std::size_t kChunk = 8192;
enum : std::uint8_t { kUnknown, kInDoubt, kKnown };  // of a cluster

CellNumbers::Cell cell_of(const double* x, double cell) {
  CellNumbers::Cell at;
  for (std::size_t k = 0; k < 3; ++k)
    at[k] = static_cast<std::int32_t>(std::floor(x[k] / cell + kShift[k]));
  return at;
}

std::size_t chunks_of(std::size_t count) { return (count + kChunk - 1) / kChunk; }

/// Calls visit(chunk, i) for all i, in order within a chunk.
template <class Visit>
void for_chunks(std::size_t count, const Visit& visit) {
  tbb::parallel_for(std::size_t{0}, chunks_of(count), [&](std::size_t chunk) {
    const std::size_t end = std::min(count, (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < end; ++i) visit(chunk, i);
  });
}

AreaVector area_vector(const MeshView& mesh, std::size_t triangle) {
  const Corners t = corners_of(mesh, static_cast<std::uint32_t>(triangle));
  AreaVector area;
  area_normal(t.p[0], t.p[1], t.p[2], area.n);
  area.length = std::sqrt(dot3(area.n, area.n));
  return area;
}

/// Sorts numbers; `work` is overwritten.
void sort_numbers(std::vector<std::uint32_t>& numbers, std::vector<std::uint32_t>& work) {
  constexpr std::size_t kFew = 256;  // are sorted faster by comparing
  if (numbers.size() < kFew) {
    std::sort(numbers.begin(), numbers.end());
    return;
  }
  const auto [least, most] = std::minmax_element(numbers.begin(), numbers.end());
  const std::uint32_t from = *least, range = *most - *least;
  work.resize(numbers.size());
  for (int shift = 0; shift < 32 && range >> shift != 0; shift += 8) {
    std::array<std::uint32_t, 257> place = {};
    const auto digit = [&](std::uint32_t number) { return (number - from) >> shift & 0xff; };
    for (const std::uint32_t number : numbers) ++place[digit(number) + 1];
    std::partial_sum(place.begin(), place.end(), place.begin());
    for (const std::uint32_t number : numbers) work[place[digit(number)]++] = number;
    numbers.swap(work);
  }
}

void lower(std::uint32_t& value, std::uint32_t to) {
  const std::atomic_ref<std::uint32_t> shared(value);
  std::uint32_t was = shared.load(std::memory_order_relaxed);
  while (to < was && !shared.compare_exchange_weak(was, to, std::memory_order_relaxed)) {
  }
}

}  // namespace

std::array<double, 3> placed(std::span<const CornerPlane> planes) {
  double weight = 0, mean[3] = {};
  for (const CornerPlane& plane : planes) {
    weight += plane.triangle.length;
    for (int k = 0; k < 3; ++k) mean[k] += plane.triangle.length * plane.x[k];
  }
  if (!(weight > 0)) return {planes[0].x[0], planes[0].x[1], planes[0].x[2]};
  for (double& m : mean) m /= weight;
  double a[3][3] = {}, b[3] = {};
  for (const auto& [triangle, x] : planes) {
    const auto& [n, length] = triangle;
    if (!(length > 0)) continue;
    const double off[3] = {x[0] - mean[0], x[1] - mean[1], x[2] - mean[2]};
    const double height = dot3(n, off) / length;
    for (int k = 0; k < 3; ++k) {
      b[k] += n[k] * height;
      for (int l = k; l < 3; ++l) a[k][l] += n[k] * (n[l] / length);
    }
  }
  for (int k = 0; k < 3; ++k) a[k][k] += kPull * weight;
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < k; ++l) a[k][l] = a[l][k];
  double y[3];
  solve(a, b, y);
  return {mean[0] + y[0], mean[1] + y[1], mean[2] + y[2]};
}

double farthest_plane(std::span<const CornerPlane> planes, const std::array<double, 3>& p) {
  double most = 0;
  for (const auto& [triangle, x] : planes) {
    const auto& [n, length] = triangle;
    if (!(length > 0)) continue;
    const double off[3] = {x[0] - p[0], x[1] - p[1], x[2] - p[2]};
    most = std::max(most, std::fabs(dot3(n, off)) / length);
  }
  return most;
}

VertexClusters::VertexClusters(const MeshView& mesh, double coarsest, int levels)
    : mesh_(mesh), areas_(mesh.triangle_count), levels_(static_cast<std::size_t>(levels)) {
  tbb::parallel_invoke(
      [&] {
        corners_ = ItemGroups<>::in_parallel(mesh.vertex_count, [&](const auto& visit) {
          tbb::parallel_for(std::uint32_t{0}, 3 * mesh.triangle_count,
                            [&](std::uint32_t i) { visit(mesh.triangles[i], i); });
        });
      },
      [&] {
        tbb::parallel_for(std::size_t{0}, levels_.size(), [&](std::size_t l) {
          levels_[l] = level_of(std::ldexp(coarsest, -static_cast<int>(l)));
        });
      },
      [&] {
        for_chunks(areas_.size(),
                   [&](std::size_t, std::size_t t) { areas_[t] = area_vector(mesh, t); });
      });
}

VertexClusters::Level VertexClusters::level_of(double cell) const {
  Level level;
  level.cell = cell;
  level.of_vertex.resize(mesh_.vertex_count);
  CellNumbers numbers;
  for (std::size_t v = 0; v < level.of_vertex.size(); ++v)
    level.of_vertex[v] = numbers.of(cell_of(mesh_.vertices + 3 * v, cell));
  level.vertices = ItemGroups<>(numbers.count(), [&](const auto& visit) {
    for (std::uint32_t v = 0; v < level.of_vertex.size(); ++v) visit(level.of_vertex[v], v);
  });
  level.place.resize(numbers.count());
  level.off.resize(numbers.count());
  level.known.resize(numbers.count());
  return level;
}

CornerPlane VertexClusters::plane_of(std::uint32_t corner, std::uint32_t vertex) const {
  CornerPlane plane;
  plane.triangle = areas_[corner / 3];
  std::copy_n(mesh_.vertices + 3 * std::size_t{vertex}, 3, plane.x);
  return plane;
}

void VertexClusters::settle(Level& level, std::uint32_t cluster) const {
  const std::span<const std::uint32_t> vertices = level.vertices[cluster];
  level.known[cluster] = kKnown;
  // What is summed is summed in the order of corners.
  thread_local std::vector<CornerPlane> planes;
  thread_local std::vector<std::uint32_t> corners, work;
  corners.clear();
  for (const std::uint32_t v : vertices)
    for (const std::uint32_t corner : corners_[v]) {
      __builtin_prefetch(&areas_[corner / 3]);
      corners.push_back(corner);
    }
  if (corners.empty()) return;
  sort_numbers(corners, work);
  planes.clear();
  for (const std::uint32_t corner : corners)
    planes.push_back(plane_of(corner, mesh_.triangles[corner]));
  std::array<double, 3> x = placed(planes);
  const CellNumbers::Cell at = cell_of(mesh_.vertices + 3 * std::size_t{vertices[0]}, level.cell);
  for (std::size_t k = 0; k < 3; ++k) {
    const double low = (at[k] - kShift[k] - 0.5) * level.cell;
    x[k] = std::clamp(x[k], low, low + 2 * level.cell);
  }
  level.place[cluster] = x;
  level.off[cluster] = farthest_plane(planes, x);
}

std::vector<std::uint32_t> VertexClusters::chosen(double tolerance) {
  std::vector<std::uint32_t> cluster_of(mesh_.vertex_count, kOpen);
  for (;;) {
    tbb::concurrent_vector<Doubt> doubts;
    for_chunks(cluster_of.size(), [&](std::size_t, std::size_t v) {
      if (cluster_of[v] != kOpen) return;
      std::size_t before = 0;
      for (std::uint32_t l = 0; l < levels_.size(); ++l) {
        Level& level = levels_[l];
        const std::uint32_t cluster = level.of_vertex[v];
        if (level.off[cluster] <= tolerance) {
          const std::atomic_ref<std::uint8_t> known(level.known[cluster]);
          const std::uint8_t was = known.load(std::memory_order_relaxed);
          if (was == kKnown) cluster_of[v] = static_cast<std::uint32_t>(before + cluster);
          if (was == kUnknown && known.exchange(kInDoubt, std::memory_order_relaxed) == kUnknown)
            doubts.push_back({l, cluster});
          return;
        }
        before += level.place.size();
      }
      cluster_of[v] = static_cast<std::uint32_t>(before + v);
    });
    if (doubts.empty()) return cluster_of;
    tbb::parallel_for(std::size_t{0}, doubts.size(),
                      [&](std::size_t i) { settle(levels_[doubts[i].level], doubts[i].cluster); });
  }
}

void VertexClusters::raise(const std::vector<double>& distance_of_cluster) {
  for (std::size_t i = 0; i < names_.size(); ++i) {
    std::size_t cluster = names_[i];
    for (Level& level : levels_) {
      if (cluster < level.off.size()) {
        level.off[cluster] = std::max(level.off[cluster], distance_of_cluster[i]);
        break;
      }
      cluster -= level.off.size();
    }
  }
}

std::vector<FloatMesh::Triangle> VertexClusters::spanning(
    const std::vector<std::uint32_t>& cluster_of) const {
  std::vector<std::vector<FloatMesh::Triangle>> parts(chunks_of(mesh_.triangle_count));
  for_chunks(mesh_.triangle_count, [&](std::size_t chunk, std::size_t t) {
    FloatMesh::Triangle corners;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = cluster_of[mesh_.triangles[3 * t + k]];
    if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0])
      parts[chunk].push_back(corners);
  });
  std::vector<FloatMesh::Triangle> triangles;
  for (const auto& part : parts) triangles.insert(triangles.end(), part.begin(), part.end());
  return triangles;
}

Clustered VertexClusters::within(double tolerance) {
  const std::vector<std::uint32_t> cluster_of = chosen(tolerance);
  std::size_t names = mesh_.vertex_count;
  for (const Level& level : levels_) names += level.place.size();
  // Only clusters that are chosen become vertices, in the order of their first vertices.
  std::vector<std::uint32_t> first(names, kOpen), before(chunks_of(cluster_of.size()) + 1);
  for_chunks(cluster_of.size(), [&](std::size_t, std::size_t v) {
    lower(first[cluster_of[v]], static_cast<std::uint32_t>(v));
  });
  for_chunks(cluster_of.size(), [&](std::size_t chunk, std::size_t v) {
    if (first[cluster_of[v]] == v) ++before[chunk + 1];
  });
  std::partial_sum(before.begin(), before.end(), before.begin());
  Clustered out;
  out.cluster_of.resize(mesh_.vertex_count);
  out.mesh.vertices.resize(before.back());
  names_.resize(before.back());
  for_chunks(cluster_of.size(), [&](std::size_t chunk, std::size_t v) {
    if (first[cluster_of[v]] != v) return;
    const std::uint32_t number = before[chunk]++;
    const std::array<double, 3> x = place_of(cluster_of[v], static_cast<std::uint32_t>(v));
    out.mesh.vertices[number] = {static_cast<float>(x[0]), static_cast<float>(x[1]),
                                 static_cast<float>(x[2])};
    out.cluster_of[v] = number;
    names_[number] = cluster_of[v];
  });
  for_chunks(cluster_of.size(), [&](std::size_t, std::size_t v) {
    const std::uint32_t at = first[cluster_of[v]];
    if (at != v) out.cluster_of[v] = out.cluster_of[at];
  });
  out.mesh.triangles = spanning(out.cluster_of);
  out.vertex_of = reduce(out.mesh);
  return out;
}

std::array<double, 3> VertexClusters::place_of(std::size_t cluster, std::uint32_t vertex) const {
  for (const Level& level : levels_) {
    if (cluster < level.place.size()) return level.place[cluster];
    cluster -= level.place.size();
  }
  const double* x = mesh_.vertices + 3 * std::size_t{vertex};
  return {x[0], x[1], x[2]};
}

}  // namespace ist
