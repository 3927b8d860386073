#include "mesh/connectivity/weld.h"

#include <tbb/parallel_for.h>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace ist {
namespace {

constexpr std::size_t kDrawers = 256;  ///< chosen by the hash's highest bits
constexpr std::size_t kWeldChunk = 16'384;

struct WeldEntry {
  std::uint32_t hash, point;
};

/// The entries of a drawer are in the order of their points: the first of equal ones is kept.
void find_first(const std::vector<Eigen::Vector3d>& points, const WeldEntry* entries,
                std::size_t count, std::vector<std::uint32_t>& first) {
  constexpr std::uint32_t kFree = UINT32_MAX;
  const std::size_t mask = std::bit_ceil(2 * count + 1) - 1;
  std::vector<WeldEntry> table(mask + 1, WeldEntry{0, kFree});
  for (std::size_t i = 0; i < count; ++i) {
    const WeldEntry& entry = entries[i];
    std::size_t at = entry.hash & mask;
    while (table[at].point != kFree &&
           !(table[at].hash == entry.hash && points[table[at].point] == points[entry.point]))
      at = (at + 1) & mask;
    if (table[at].point == kFree) table[at] = entry;
    first[entry.point] = table[at].point;
  }
}

/// [vertex] 1 if a triangle references it.
std::vector<std::uint8_t> referenced(const TriangleMesh& mesh) {
  std::vector<std::uint8_t> used(mesh.vertices.size(), 0);
  tbb::parallel_for(std::size_t{0}, mesh.triangles.size(), [&](std::size_t t) {
    for (const std::uint32_t v : mesh.triangles[t])
      std::atomic_ref<std::uint8_t>(used[v]).store(1, std::memory_order_relaxed);
  });
  return used;
}

void rename_corners(TriangleMesh& mesh, const std::vector<std::uint32_t>& names) {
  tbb::parallel_for(std::size_t{0}, mesh.triangles.size(), [&](std::size_t t) {
    for (std::uint32_t& v : mesh.triangles[t]) v = names[v];
  });
}

/// Keeps the used vertices that are their own representatives; sets `name` to the new index of
/// each.
void keep_first(TriangleMesh& mesh, const std::vector<std::uint8_t>& used,
                std::vector<std::uint32_t>& name) {
  std::atomic<bool> all{true};
  tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(name.size()),
                    [&](std::uint32_t v) {
                      mesh.vertices[v] += Eigen::Vector3d::Zero();  // turns −0 into 0
                      if (used[v] == 0 || name[v] != v) all.store(false, std::memory_order_relaxed);
                    });
  if (all) return;
  std::uint32_t kept = 0;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (used[v] == 0) continue;
    const bool is_first = name[v] == v;
    if (is_first) mesh.vertices[kept] = mesh.vertices[v];
    name[v] = is_first ? kept++ : name[name[v]];  // the representative's new index is already known
  }
  mesh.vertices.resize(kept);
  rename_corners(mesh, name);
}

}  // namespace

std::vector<std::uint32_t> first_equal(const std::vector<Eigen::Vector3d>& points,
                                       const std::vector<std::uint8_t>& used) {
  // Chunks of points count their entries for each drawer, then write them there in order.
  const std::size_t chunks = (points.size() + kWeldChunk - 1) / kWeldChunk;
  std::vector<std::uint64_t> hashes(points.size());
  std::vector<std::array<std::uint32_t, kDrawers>> place(chunks);
  const auto for_each_used = [&](const auto& visit) {
    tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
      for (std::size_t p = c * kWeldChunk; p < std::min((c + 1) * kWeldChunk, points.size()); ++p)
        if (used[p] != 0) visit(c, p);
    });
  };
  for (auto& counts : place) counts.fill(0);
  for_each_used([&](std::size_t c, std::size_t p) {
    hashes[p] = hash_of_bits(points[p]);
    ++place[c][hashes[p] >> 56];
  });
  std::array<std::uint32_t, kDrawers + 1> begin{};
  std::uint32_t sum = 0;
  for (std::size_t d = 0; d < kDrawers; ++d) {
    begin[d] = sum;
    for (auto& counts : place) {
      const std::uint32_t count = counts[d];
      counts[d] = sum;
      sum += count;
    }
  }
  begin[kDrawers] = sum;
  std::vector<WeldEntry> entries(sum);
  for_each_used([&](std::size_t c, std::size_t p) {
    entries[place[c][hashes[p] >> 56]++] = {static_cast<std::uint32_t>(hashes[p]),
                                            static_cast<std::uint32_t>(p)};
  });
  std::vector<std::uint32_t> first(points.size());
  tbb::parallel_for(std::size_t{0}, kDrawers, [&](std::size_t d) {
    find_first(points, entries.data() + begin[d], begin[d + 1] - begin[d], first);
  });
  return first;
}

TriangleMesh weld(TriangleMesh mesh, double tolerance) {
  if (tolerance > 0)
    return weld_among(mesh, tolerance, std::vector<bool>(mesh.vertices.size(), true));
  mesh.declared = {};
  const std::vector<std::uint8_t> used = referenced(mesh);
  std::vector<std::uint32_t> name = first_equal(mesh.vertices, used);
  keep_first(mesh, used, name);
  return mesh;
}

void drop_unused(TriangleMesh& mesh) {
  const std::vector<std::uint8_t> used = referenced(mesh);
  if (std::find(used.begin(), used.end(), 0) == used.end()) return;
  std::vector<std::uint32_t> name(mesh.vertices.size());
  std::iota(name.begin(), name.end(), 0u);
  keep_first(mesh, used, name);
}

TriangleMesh weld_among(const TriangleMesh& mesh, double tolerance,
                        const std::vector<bool>& among) {
  constexpr std::uint32_t kNone = UINT32_MAX;
  const std::vector<std::uint8_t> used = referenced(mesh);
  TriangleMesh result;
  std::vector<std::uint32_t> kept_as(mesh.vertices.size(), kNone);
  // Kept vertices by their cell's hash. Candidates lie in one or two cells along an axis.
  const double width = 4 * tolerance;
  const auto count = static_cast<std::size_t>(std::count(among.begin(), among.end(), true));
  const std::size_t mask = std::bit_ceil(2 * count + 1) - 1;
  std::vector<WeldEntry> table(mask + 1, WeldEntry{0, kNone});
  const auto place_of = [&](const Eigen::Vector3d& cell) {
    return static_cast<std::uint32_t>(hash_of_bits(cell));
  };
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (used[i] == 0) continue;
    const Eigen::Vector3d& p = mesh.vertices[i];
    std::uint32_t first = kNone;
    const Eigen::Vector3d scaled = p / width, cell = scaled.array().floor();
    if (among[i]) {
      int low[3], high[3];
      for (int k = 0; k < 3; ++k) {
        const double within = scaled[k] - cell[k],
                     reach = 0.25 + 1e-15 * std::abs(scaled[k]) + 1e-9;
        low[k] = within <= reach ? -1 : 0;
        high[k] = within >= 1 - reach ? 1 : 0;
      }
      for (int x = low[0]; x <= high[0]; ++x)
        for (int y = low[1]; y <= high[1]; ++y)
          for (int z = low[2]; z <= high[2]; ++z) {
            const std::uint32_t hash = place_of(cell + Eigen::Vector3d(x, y, z));
            for (std::size_t at = hash & mask; table[at].point != kNone; at = (at + 1) & mask)
              if (table[at].hash == hash && table[at].point < first &&
                  (result.vertices[table[at].point] - p).norm() <= tolerance)
                first = table[at].point;
          }
    }
    if (first == kNone) {
      first = static_cast<std::uint32_t>(result.vertices.size());
      result.vertices.emplace_back(p + Eigen::Vector3d::Zero());
      if (among[i]) {
        const std::uint32_t hash = place_of(cell);
        std::size_t at = hash & mask;
        while (table[at].point != kNone) at = (at + 1) & mask;
        table[at] = {hash, first};
      }
    }
    kept_as[i] = first;
  }
  result.triangles = mesh.triangles;
  rename_corners(result, kept_as);
  return result;
}

}  // namespace ist
