#include "mesh/self_intersections.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <utility>

#include "mesh/fans.h"
#include "mesh/triangle_boxes.h"
#include "mesh/triangle_separation.h"

namespace ist {
namespace {

/// Whether the exact boxes of two triangles meet.
bool boxes_meet(const std::vector<Eigen::Vector3d>& vertices, const Triangle& a,
                const Triangle& b) {
  const auto range = [&](const Triangle& t, const int k) {
    return std::minmax({vertices[t[0]][k], vertices[t[1]][k], vertices[t[2]][k]});
  };
  for (const int k : {0, 1, 2}) {
    const auto [low_a, high_a] = range(a, k);
    const auto [low_b, high_b] = range(b, k);
    if (low_a > high_b || low_b > high_a) return false;
  }
  return true;
}

/// Corners with spread fans, by place; kNoIndex for others.
std::vector<Triangle> spread_corners(const std::vector<Eigen::Vector3d>& vertices,
                                     const std::vector<Triangle>& triangles,
                                     const TriangleBoxes& boxes) {
  const std::vector<std::uint8_t> spread = spread_fans(vertices, triangles);
  std::vector<Triangle> corners(boxes.size());
  tbb::parallel_for(std::size_t{0}, boxes.size(), [&](const std::size_t place) {
    const Triangle& t = triangles[boxes.triangle(place)];
    for (std::size_t k = 0; k < 3; ++k) corners[place][k] = spread[t[k]] != 0 ? t[k] : kNoIndex;
  });
  return corners;
}

bool share_corner(const Triangle& a, const Triangle& b) {
  bool shared = false;
  for (const std::uint32_t v : a)
    shared |= ((v == b[0]) | (v == b[1]) | (v == b[2])) & (v != kNoIndex);
  return shared;
}

constexpr std::size_t kMostTriangles = 2'000'000, kMostCandidates = 50'000'000;
constexpr std::size_t kMostPairs = 10'000'000;

/// What the parts of a search know and add to. Integers only: their sums do not depend on the
/// order.
struct Search {
  const std::vector<Eigen::Vector3d>& vertices;
  const std::vector<Triangle>& triangles;
  const TriangleBoxes boxes{vertices, triangles};
  const std::vector<Triangle> spread = spread_corners(vertices, triangles, boxes);
  std::atomic<std::size_t> candidates{0}, met{0};
};

/// Looks at the candidates of one part.
class Visitor {
 public:
  Visitor(Search& search, std::vector<std::array<std::uint32_t, 2>>& pairs)
      : search_(search), pairs_(pairs) {}
  Visitor(const Visitor&) = delete;
  Visitor& operator=(const Visitor&) = delete;
  ~Visitor() { search_.candidates += candidates_; }

  bool done() const { return search_.candidates.load(std::memory_order_relaxed) > kMostCandidates; }

  void operator()(const std::size_t i, const std::size_t j) {
    const bool spread_out = share_corner(search_.spread[i], search_.spread[j]);
    if (spread_out || look_at(search_.boxes.triangle(i), search_.boxes.triangle(j))) {
      constexpr std::size_t kOften = 1024;
      if (++candidates_ == kOften) search_.candidates += std::exchange(candidates_, 0);
    }
  }

 private:
  /// Whether they are candidates.
  bool look_at(const std::uint32_t a, const std::uint32_t b) {
    const std::vector<Eigen::Vector3d>& vertices = search_.vertices;
    const Triangle &of_a = search_.triangles[a], &of_b = search_.triangles[b];
    if (!boxes_meet(vertices, of_a, of_b)) return false;
    if (!seen_apart(vertices, of_a, of_b) && meet_elsewhere(vertices, of_a, of_b) &&
        search_.met++ < kMostPairs)
      pairs_.push_back({std::min(a, b), std::max(a, b)});
    return true;
  }

  Search& search_;
  std::vector<std::array<std::uint32_t, 2>>& pairs_;
  std::size_t candidates_ = 0;  ///< not yet in the sum
};

}  // namespace

std::optional<SelfIntersections> find_self_intersections(
    const std::vector<Eigen::Vector3d>& vertices, const std::vector<Triangle>& triangles) {
  if (triangles.size() > kMostTriangles) return std::nullopt;
  Search search{vertices, triangles};
  tbb::enumerable_thread_specific<std::vector<std::array<std::uint32_t, 2>>> of_threads;
  tbb::parallel_for(std::size_t{0}, search.boxes.parts(), [&](const std::size_t part) {
    Visitor visitor(search, of_threads.local());
    search.boxes.for_each_pair(part, visitor);
  });
  if (search.candidates > kMostCandidates) return std::nullopt;
  SelfIntersections result{search.met, std::nullopt};
  if (result.count > kMostPairs) return result;
  result.pairs.emplace();
  for (const auto& pairs : of_threads)
    result.pairs->insert(result.pairs->end(), pairs.begin(), pairs.end());
  std::sort(result.pairs->begin(), result.pairs->end());
  return result;
}

}  // namespace ist
