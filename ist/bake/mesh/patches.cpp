#include "bake/mesh/kept_mesh.h"

#include <ist/asset_layout.h>
#include <tbb/parallel_invoke.h>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "mesh/connectivity/item_groups.h"
#include "mesh/geometry/triangle_frame.h"

namespace ist {
namespace {

using FloatPoint = std::array<float, 3>;

std::size_t longest_axis(std::span<const FloatPoint> points, std::span<const std::uint32_t> order) {
  FloatPoint low = points[order.front()], high = low;
  for (const std::uint32_t i : order)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], points[i][k]);
      high[k] = std::max(high[k], points[i][k]);
    }
  std::size_t longest = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (high[k] - low[k] > high[longest] - low[longest]) longest = k;
  return longest;
}

/// About half of n > 16, in whole groups of the largest size that leaves a choice.
std::size_t first_half(std::size_t n) {
  std::size_t group = kWidth;
  while (group * kWidth < n) group *= kWidth;
  return std::max<std::size_t>(1, (n + group) / (2 * group)) * group;
}

void halve(std::span<const FloatPoint> points, std::span<std::uint32_t> order) {
  if (order.size() <= kWidth) return;
  const std::size_t axis = longest_axis(points, order);
  const std::size_t half = first_half(order.size());
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(half), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) {
                     return std::pair(points[a][axis], a) < std::pair(points[b][axis], b);
                   });
  const std::span<std::uint32_t> first = order.first(half), second = order.subspan(half);
  if (order.size() < 4096) {
    halve(points, first);
    halve(points, second);
  } else {
    tbb::parallel_invoke([&] { halve(points, first); }, [&] { halve(points, second); });
  }
}

/// Sorts each last group by index: the output order of nth_element is unspecified.
void settle(std::span<std::uint32_t> order) {
  for (std::size_t begin = 0; begin < order.size(); begin += kWidth)
    std::sort(order.begin() + static_cast<std::ptrdiff_t>(begin),
              order.begin() +
                  static_cast<std::ptrdiff_t>(std::min<std::size_t>(begin + kWidth, order.size())));
}

constexpr std::uint32_t kNone = ~0u;
/// Patches are joined if the result is not larger than this, in radii of the larger.
constexpr double kJoinedRadius = 1.5;

double dot(const FloatPoint& a, const FloatPoint& b) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += double{a[k]} * double{b[k]};
  return sum;
}

double distance2(const FloatPoint& a, const FloatPoint& b) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double d = double{a[k]} - double{b[k]};
    sum += d * d;
  }
  return sum;
}

/// Patches grow last over sides where the surface turns by more than 45°, so that those of a
/// thread's flanks and of a part's faces are thin along their normals. In 1 − cos of the angle.
constexpr double kCrease = 0.3;

/// Neighbours are not searched at a vertex of more triangles than this: other corners lead to them,
/// and visiting all of them for each patch would take quadratic time.
constexpr std::size_t kLargestStar = 1024;

class Growth {
 public:
  explicit Growth(const FloatMesh& mesh)
      : mesh_(mesh),
        stars_(triangles_at_vertices(mesh.vertices.size(), mesh.triangles)),
        left_(mesh.vertices.size()),
        taken_(mesh.triangles.size()),
        last_patch_(mesh.vertices.size()),
        middle_(mesh.triangles.size()),
        normal_(mesh.triangles.size()) {
    for (std::size_t v = 0; v < left_.size(); ++v)
      left_[v] = static_cast<std::uint32_t>(stars_[v].size());
    for (std::size_t t = 0; t < middle_.size(); ++t) {
      double corner[3][3], normal[3];
      for (std::size_t c = 0; c < 3; ++c)
        std::copy_n(mesh.vertices[mesh.triangles[t][c]].begin(), 3, corner[c]);
      area_normal(corner[0], corner[1], corner[2], normal);
      const double length =
          std::sqrt((normal[0] * normal[0] + normal[1] * normal[1]) + normal[2] * normal[2]);
      for (std::size_t k = 0; k < 3; ++k) {
        middle_[t][k] = static_cast<float>(((corner[0][k] + corner[1][k]) + corner[2][k]) / 3);
        normal_[t][k] = static_cast<float>(length > 0 ? normal[k] / length : 0);
      }
    }
  }

  std::vector<BlockPatch> all() {
    std::vector<BlockPatch> patches;
    std::uint32_t seed = kNone;
    for (const std::uint32_t next : spatial_order(middle_)) {
      // Starts next to the last patch as long as triangles are left there.
      while (seed != kNone || taken_[next] == 0) {
        patches.push_back(grown(seed != kNone ? seed : next));
        seed = beside(patches.back());
      }
    }
    return patches;
  }

 private:
  BlockPatch grown(std::uint32_t seed) {
    BlockPatch patch;
    ++patches_;
    for (std::uint32_t t = seed; t != kNone; t = best_neighbour(patch)) take(t, patch);
    return patch;
  }

  void take(std::uint32_t t, BlockPatch& patch) {
    taken_[t] = 1;
    patch.triangles.push_back(t);
    for (const std::uint32_t v : mesh_.triangles[t]) {
      --left_[v];
      if (!is_in_patch(v)) patch.vertices.push_back(v);
      last_patch_[v] = patches_;
    }
  }

  /// True if the vertex is in the growing patch.
  bool is_in_patch(std::uint32_t vertex) const { return last_patch_[vertex] == patches_; }

  /// True if there is a crease at all sides that a triangle shares with the patch or, where it
  /// touches in a corner only, between their normals.
  bool is_over_crease(std::uint32_t triangle, const BlockPatch& patch, double turned) const {
    double least_turned = 2;
    for (const std::uint32_t other : patch.triangles) {
      int shared = 0;
      for (const std::uint32_t v : mesh_.triangles[triangle])
        shared += std::ranges::count(mesh_.triangles[other], v) > 0 ? 1 : 0;
      if (shared >= 2)
        least_turned = std::min(least_turned, 1 - dot(normal_[triangle], normal_[other]));
    }
    return (least_turned < 2 ? least_turned : turned) > kCrease;
  }

  /// Among the triangles that touch the patch and fit, one over no crease; then the one that adds
  /// fewest vertices, with a bonus for those that would be isolated; then the one nearest to the
  /// patch's middle, where a turned normal counts as distance.
  std::uint32_t best_neighbour(const BlockPatch& patch) const {
    if (patch.triangles.size() == kWidth) return kNone;
    FloatPoint middle = {}, normal = {};
    for (const std::uint32_t t : patch.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        middle[k] += middle_[t][k] / static_cast<float>(patch.triangles.size());
        normal[k] += normal_[t][k];
      }
    const double length = std::sqrt(dot(normal, normal)) + 1e-30;  // not 0
    using Score = std::tuple<bool, int, double, std::uint32_t>;
    Score best{true, 4, 0, kNone};
    for (const std::uint32_t v : patch.vertices) {
      if (left_[v] == 0 || stars_[v].size() > kLargestStar) continue;
      for (const std::uint32_t t : stars_[v]) {
        if (taken_[t] != 0) continue;
        int added = 0, last = 0;
        for (const std::uint32_t corner : mesh_.triangles[t]) {
          added += is_in_patch(corner) ? 0 : 1;
          last |= left_[corner] == 1 ? 1 : 0;
        }
        if (patch.vertices.size() + static_cast<std::size_t>(added) > kWidth) continue;
        const double turned = 1 - dot(normal_[t], normal) / length;
        Score score{false, std::max(0, added - last), distance2(middle_[t], middle) * (1 + turned),
                    t};
        if (!(score < best)) continue;
        std::get<0>(score) = is_over_crease(t, patch, turned);
        best = std::min(best, score);
      }
    }
    return std::get<3>(best);
  }

  /// Among the triangles at the patch with the fewest remaining neighbours, the one nearest to its
  /// first.
  std::uint32_t beside(const BlockPatch& patch) const {
    using Score = std::tuple<std::uint32_t, double, std::uint32_t>;
    Score best{kNone, 0, kNone};
    for (const std::uint32_t v : patch.vertices) {
      if (stars_[v].size() > kLargestStar) continue;
      for (const std::uint32_t t : stars_[v]) {
        if (taken_[t] != 0) continue;
        std::uint32_t left = 0;
        for (const std::uint32_t corner : mesh_.triangles[t]) left += left_[corner];
        best =
            std::min(best, Score{left, distance2(middle_[t], middle_[patch.triangles.front()]), t});
      }
    }
    return std::get<2>(best);
  }

  const FloatMesh& mesh_;
  const ItemGroups<> stars_;         ///< the triangles around each vertex
  std::vector<std::uint32_t> left_;  ///< those in no patch yet
  std::vector<std::uint8_t> taken_;
  std::vector<std::uint32_t> last_patch_;  ///< [vertex] the last patch that contains it, from 1
  std::uint32_t patches_ = 0;
  std::vector<FloatPoint> middle_, normal_;  ///< of triangles
};

/// A ball around a patch: the middle of its box and the farthest vertex.
struct PatchExtent {
  FloatPoint middle;
  double radius;
};

PatchExtent extent_of(const FloatMesh& mesh, const std::vector<std::uint32_t>& vertices) {
  FloatPoint low = mesh.vertices[vertices[0]], high = low;
  for (const std::uint32_t v : vertices)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], mesh.vertices[v][k]);
      high[k] = std::max(high[k], mesh.vertices[v][k]);
    }
  PatchExtent out{{}, 0};
  for (std::size_t k = 0; k < 3; ++k) out.middle[k] = (low[k] + high[k]) / 2;
  for (const std::uint32_t v : vertices)
    out.radius = std::max(out.radius, distance2(mesh.vertices[v], out.middle));
  out.radius = std::sqrt(out.radius);
  return out;
}

std::vector<std::uint32_t> united(const BlockPatch& a, const BlockPatch& b) {
  std::vector<std::uint32_t> all = a.vertices;
  for (const std::uint32_t v : b.vertices)
    if (std::find(a.vertices.begin(), a.vertices.end(), v) == a.vertices.end()) all.push_back(v);
  return all;
}

/// Joins incomplete patches to others near them that share a vertex.
std::vector<BlockPatch> joined(const FloatMesh& mesh, std::vector<BlockPatch> patches) {
  std::vector<FloatPoint> middles(patches.size());
  std::vector<double> radii(patches.size());
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const PatchExtent extent = extent_of(mesh, patches[p].vertices);
    middles[p] = extent.middle;
    radii[p] = extent.radius;
  }
  constexpr std::size_t kWindow = 24;  // following patches that are tried
  const std::vector<std::uint32_t> order = spatial_order(middles);
  for (std::size_t i = 0; i < order.size(); ++i) {
    BlockPatch& patch = patches[order[i]];
    double best = HUGE_VAL;
    std::uint32_t into = kNone;
    for (std::size_t j = i + 1; j < std::min(order.size(), i + kWindow); ++j) {
      const BlockPatch& other = patches[order[j]];
      if (patch.triangles.size() + other.triangles.size() > kWidth) continue;
      const std::vector<std::uint32_t> vertices = united(patch, other);
      if (vertices.size() > kWidth) continue;
      if (vertices.size() == patch.vertices.size() + other.vertices.size()) continue;
      const double radius = extent_of(mesh, vertices).radius;
      if (radius < best && radius <= kJoinedRadius * std::max(radii[order[i]], radii[order[j]])) {
        best = radius;
        into = order[j];
      }
    }
    if (into == kNone) continue;
    patches[into].vertices = united(patches[into], patch);
    patches[into].triangles.insert(patches[into].triangles.end(), patch.triangles.begin(),
                                   patch.triangles.end());
    radii[into] = best;
    patch = {};
  }
  std::erase_if(patches, [](const BlockPatch& p) { return p.triangles.empty(); });
  return patches;
}

}  // namespace

FloatMesh in_floats(const MeshView& mesh) {
  FloatMesh out;
  out.vertices.resize(mesh.vertex_count);
  out.triangles.resize(mesh.triangle_count);
  for (std::size_t v = 0; v < out.vertices.size(); ++v)
    for (std::size_t k = 0; k < 3; ++k)
      out.vertices[v][k] = static_cast<float>(mesh.vertices[3 * v + k]);
  for (std::size_t t = 0; t < out.triangles.size(); ++t)
    std::copy_n(mesh.triangles + 3 * t, 3, out.triangles[t].begin());
  return out;
}

std::vector<std::uint32_t> spatial_order(std::span<const FloatPoint> points) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  halve(points, order);
  settle(order);
  return order;
}

std::vector<BlockPatch> cut_into_patches(const FloatMesh& mesh) {
  return joined(mesh, Growth(mesh).all());
}

}  // namespace ist
