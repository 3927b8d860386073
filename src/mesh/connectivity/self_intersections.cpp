#include "mesh/connectivity/self_intersections.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>
#include <algorithm>
#include <atomic>
#include <limits>

#include "base/bits.h"
#include "base/hashing.h"
#include "base/raw_array.h"
#include "mesh/connectivity/fan_slabs.h"
#include "mesh/connectivity/surface_reduction.h"
#include "mesh/connectivity/usable_mesh.h"
#include "mesh/geometry/exact_triangle.h"

namespace ist {
namespace {

/// Eight boxes side by side. An unused box is empty: lower = ∞, upper = −∞.
struct alignas(64) EightBoxes {
  static constexpr std::size_t kWidth = 8;
  EightBoxes() {}  // uninitialised, for threads to fill
  float lower[3][kWidth], upper[3][kWidth];

  /// Bit k: box k meets box `lane` of `other`.
  unsigned met_by(const EightBoxes& other, std::size_t lane) const {
    constexpr int kBit[kWidth] = {1, 2, 4, 8, 16, 32, 64, 128};
    float low[3], high[3];
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = other.lower[i][lane];
      high[i] = other.upper[i][lane];
    }
    int met = 0;  // in a form that compilers vectorise
    for (std::size_t k = 0; k < kWidth; ++k)
      met |= (lower[0][k] <= high[0] ? kBit[k] : 0) & (upper[0][k] >= low[0] ? kBit[k] : 0) &
             (lower[1][k] <= high[1] ? kBit[k] : 0) & (upper[1][k] >= low[1] ? kBit[k] : 0) &
             (lower[2][k] <= high[2] ? kBit[k] : 0) & (upper[2][k] >= low[2] ? kBit[k] : 0);
    return static_cast<unsigned>(met);
  }
};

/// Triangles along a space-filling curve, with boxes around each of them and around 8, 64, 512 … of
/// them. Degenerate triangles are left out. Coordinates are moved to the bounds' corner, divided by
/// their width and rounded to float. This keeps their order, so boxes that meet still do.
class TriangleBoxes {
 public:
  /// Runs on the caller's TBB threads. At most 2^21 triangles. `spread`: the result of
  /// spread_fans(), or empty if the search is for pairs that do not meet. The triangles of a large
  /// fan are consecutive, and their pairs are skipped if whole nodes are known not to meet.
  /// `margin`: [u] boxes no further apart meet. `oriented`: nodes always have boxes along their
  /// triangles, not only for large fans or needles.
  TriangleBoxes(const std::vector<Eigen::Vector3d>& vertices,
                const std::vector<Triangle>& triangles,
                const std::vector<std::uint32_t>& spread = {}, double margin = 0,
                bool oriented = false);

  /// Pairs of two marked triangles need not be visited. [triangle]
  void leave_out(const std::vector<std::uint8_t>& marked);

  std::size_t size() const { return order_.size(); }
  bool oriented() const { return !slabs_.empty(); }
  /// The triangle at a position on the curve.
  std::uint32_t triangle(std::size_t place) const { return order_[place]; }

  /// The number of parts of the search for pairs.
  std::size_t parts() const { return levels_[start_].size(); }

  /// Calls visit(i, j), i < j, for every two positions whose boxes meet and that belong to one part
  /// of the search, until visit.done() is true.
  template <class Visit>
  void for_each_pair(std::size_t part, Visit& visit) const {
    // A node of the starting level against itself and those after it.
    within(start_, part, visit);
    if (start_ + 1 == levels_.size()) return;
    const std::vector<EightBoxes>& above = levels_[start_ + 1];
    for (std::size_t block = part / 8; block < above.size(); ++block) {
      unsigned met = above[block].met_by(above[part / 8], part % 8);
      if (block == part / 8) met &= ~1u << part % 8;
      met &= wanted(start_ + 1, part, block);
      for (const std::uint32_t k : set_bits(met)) between(start_, part, 8 * block + k, visit);
    }
  }

 private:
  /// Bit k: pairs of node `a` of the level below and box k of a node are to be visited.
  unsigned wanted(std::size_t level, std::size_t a, std::size_t node) const {
    if (wanted_.empty() || (wanted_[level][a / 8] >> a % 8 & 1) != 0) return ~0u;
    return wanted_[level][node];
  }

  template <class Visit>
  void within(std::size_t level, std::size_t node, Visit& visit) const {
    if (!slabs_.empty() && slabs_[level][node].spread) return;
    if (!wanted_.empty() && wanted_[level][node] == 0) return;
    const EightBoxes& boxes = levels_[level][node];
    const std::size_t below = level == 0 ? order_.size() : levels_[level - 1].size();
    for (std::size_t k = 0; k < 8 && 8 * node + k < below; ++k) {
      if (level > 0) within(level - 1, 8 * node + k, visit);
      const unsigned met = boxes.met_by(boxes, k) & ~1u << k & wanted(level, 8 * node + k, node);
      for (const std::uint32_t l : set_bits(met)) pair(level, 8 * node + k, 8 * node + l, visit);
    }
  }

  /// Visits all pairs of a triangle under node a and one under node b, both of one level, a < b.
  template <class Visit>
  void between(std::size_t level, std::size_t a, std::size_t b, Visit& visit) const {
    if (visit.done()) return;
    if (!slabs_.empty()) {
      const Slab &slab_a = slabs_[level][a], &slab_b = slabs_[level][b];
      if (slab_a.apart_about_owner(slab_b) || slab_a.apart_from(slab_b)) return;
      if (level == 0 && slices_[a].apart_from(slices_[b])) return;
    }
    const EightBoxes &of_a = levels_[level][a], &of_b = levels_[level][b];
    for (const std::uint32_t k : set_bits(of_a.met_by(levels_[level + 1][b / 8], b % 8))) {
      const std::size_t child = 8 * a + k;
      for (const std::uint32_t l : set_bits(of_b.met_by(of_a, k) & wanted(level, child, b)))
        pair(level, child, 8 * b + l, visit);
    }
  }

  /// Visits pairs of children of a level's nodes.
  template <class Visit>
  void pair(std::size_t level, std::size_t a, std::size_t b, Visit& visit) const {
    if (level == 0)
      visit(a, b);
    else
      between(level - 1, a, b, visit);
  }

  std::vector<std::uint32_t> order_;
  std::size_t start_ = 0;                        ///< level
  std::vector<std::vector<EightBoxes>> levels_;  ///< [0]: boxes of triangles; the last has one node
  /// One for each node up to the starting level if there are large fans or needles, else empty.
  std::vector<std::vector<Slab>> slabs_;
  std::vector<Slice> slices_;  ///< of level 0, with slabs
  /// [level][node] Bit k: box k contains an unmarked triangle. Empty if nothing is marked.
  std::vector<std::vector<std::uint8_t>> wanted_;
};

constexpr std::uint64_t kLeftOut = UINT64_MAX;
constexpr int kIndexBits = 21;
constexpr float kCells = 1 << 14;  ///< of the curve, along each axis

/// Maps vertices to [0, 1], keeping the order along each axis.
RawArray<FloatPoint> placed(const std::vector<Eigen::Vector3d>& vertices) {
  const Eigen::AlignedBox3d bounds = bounds_of(vertices);
  const Eigen::Vector3d corner = bounds.min();
  const double width = bounds.sizes().maxCoeff();
  RawArray<FloatPoint> points(vertices.size());
  tbb::parallel_for(std::size_t{0}, vertices.size(), [&](std::size_t v) {
    for (int k = 0; k < 3; ++k)
      points[v][static_cast<std::size_t>(k)] =
          static_cast<float>((vertices[v][k] - corner[k]) / width);
  });
  return points;
}

/// The position of a triangle's middle on the curve.
std::uint64_t key_of(const RawArray<FloatPoint>& points, const Triangle& t) {
  std::uint64_t key = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const float middle = (points[t[0]][k] + points[t[1]][k] + points[t[2]][k]) / 3;
    key |= spread_bits(static_cast<std::uint64_t>(std::min(middle * kCells, kCells - 1))) << k;
  }
  return key;
}

EightBoxes no_boxes() {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  EightBoxes boxes;
  for (std::size_t k = 0; k < 3; ++k) {
    std::fill_n(boxes.lower[k], EightBoxes::kWidth, kFar);
    std::fill_n(boxes.upper[k], EightBoxes::kWidth, -kFar);
  }
  return boxes;
}

/// Makes blocks of eight: box_of(i, k) gives the lower and the upper bound of box i along axis k.
template <class BoxOf>
std::vector<EightBoxes> in_eights(std::size_t count, const BoxOf& box_of) {
  std::vector<EightBoxes> blocks((count + 7) / 8);
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    EightBoxes boxes = no_boxes();
    for (std::size_t i = 8 * b; i < std::min(8 * b + 8, count); ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [lower, upper] = box_of(i, k);
        boxes.lower[k][i % 8] = lower;
        boxes.upper[k][i % 8] = upper;
      }
    blocks[b] = boxes;
  });
  return blocks;
}

TriangleBoxes::TriangleBoxes(const std::vector<Eigen::Vector3d>& vertices,
                             const std::vector<Triangle>& triangles,
                             const std::vector<std::uint32_t>& spread, double margin,
                             bool oriented) {
  const RawArray<FloatPoint> points = placed(vertices);
  float wider = 0;
  if (margin > 0) {
    constexpr double kRounding = 0x1p-22;  // of two coordinates
    wider = static_cast<float>(2 * margin / bounds_of(vertices).sizes().maxCoeff() + kRounding);
  }
  RawArray<std::uint64_t> keys(triangles.size());
  tbb::parallel_for(std::size_t{0}, triangles.size(), [&](std::size_t t) {
    keys[t] = is_degenerate(vertices, triangles[t])
                  ? kLeftOut
                  : key_of(points, triangles[t]) << kIndexBits | t;
  });
  tbb::parallel_sort(keys.begin(), keys.end());
  order_.resize(std::lower_bound(keys.begin(), keys.end(), kLeftOut) - keys.begin());
  tbb::parallel_for(std::size_t{0}, order_.size(), [&](std::size_t i) {
    order_[i] = static_cast<std::uint32_t>(keys[i] & ((std::uint64_t{1} << kIndexBits) - 1));
  });
  std::vector<std::uint32_t> owners;
  if (!spread.empty()) owners = owners_of(triangles, vertices.size());
  if (!owners.empty()) {
    std::stable_sort(order_.begin(), order_.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return owners[a] < owners[b]; });
  } else if (
      oriented ||
      mean_slenderness(triangles.size(), [&](std::size_t t) {
        const Triangle& of = triangles[t];
        return Corners{{vertices[of[0]].data(), vertices[of[1]].data(), vertices[of[2]].data()}};
      }) > kSlender) {
    owners.assign(triangles.size(), kNoIndex);
  }

  levels_.push_back(in_eights(order_.size(), [&](std::size_t i, std::size_t k) {
    const Triangle& t = triangles[order_[i]];
    const auto [low, high] = std::minmax({points[t[0]][k], points[t[1]][k], points[t[2]][k]});
    return std::pair{low, high + wider};
  }));
  while (levels_.back().size() > 1) {
    const std::vector<EightBoxes>& below = levels_.back();
    levels_.push_back(in_eights(below.size(), [&](std::size_t i, std::size_t k) {
      return std::pair{*std::min_element(below[i].lower[k], below[i].lower[k] + 8),
                       *std::max_element(below[i].upper[k], below[i].upper[k] + 8)};
    }));
  }
  constexpr std::size_t kMostParts = 2048;
  while (levels_[start_].size() > kMostParts) ++start_;
  if (owners.empty()) return;
  for (std::size_t level = 0, size = 8; level <= start_; ++level, size *= 8) {
    std::vector<Slab>& slabs = slabs_.emplace_back(levels_[level].size());
    tbb::parallel_for(std::size_t{0}, slabs.size(), [&](std::size_t node) {
      const std::span<const std::uint32_t> all(order_);
      slabs[node] = slab_of(points, triangles,
                            all.subspan(size * node, std::min(size, all.size() - size * node)),
                            owners, spread, double{wider});
    });
  }
  slices_.resize(levels_[0].size());
  tbb::parallel_for(std::size_t{0}, slices_.size(), [&](std::size_t node) {
    const std::span<const std::uint32_t> all(order_);
    slices_[node] = slice_of(points, triangles,
                             all.subspan(8 * node, std::min<std::size_t>(8, all.size() - 8 * node)),
                             double{wider});
  });
}

void TriangleBoxes::leave_out(const std::vector<std::uint8_t>& marked) {
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    const std::size_t count = level == 0 ? order_.size() : levels_[level - 1].size();
    std::vector<std::uint8_t> bits(levels_[level].size(), 0);
    for (std::size_t i = 0; i < count; ++i)
      if (level == 0 ? marked[order_[i]] == 0 : wanted_[level - 1][i] != 0)
        bits[i / 8] = static_cast<std::uint8_t>(bits[i / 8] | 1 << i % 8);
    wanted_.push_back(std::move(bits));
  }
}

/// True if the exact boxes of two triangles meet.
bool boxes_meet(const std::vector<Eigen::Vector3d>& vertices, const Triangle& a,
                const Triangle& b) {
  const auto range = [&](const Triangle& t, int k) {
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
std::vector<Triangle> spread_corners(const std::vector<Triangle>& triangles,
                                     const std::vector<std::uint32_t>& fans,
                                     const TriangleBoxes& boxes) {
  std::vector<Triangle> corners(boxes.size());
  tbb::parallel_for(std::size_t{0}, boxes.size(), [&](std::size_t place) {
    const Triangle& t = triangles[boxes.triangle(place)];
    for (std::size_t k = 0; k < 3; ++k) corners[place][k] = fans[t[k]] != 0 ? t[k] : kNoIndex;
  });
  return corners;
}

bool share_corner(const Triangle& a, const Triangle& b) {
  bool shared = false;
  for (const std::uint32_t v : a)
    shared |= ((v == b[0]) | (v == b[1]) | (v == b[2])) & (v != kNoIndex);
  return shared;
}

constexpr std::size_t kMostTriangles = 2'000'000, kMostPairs = 10'000'000;

/// A limit of candidates: the boxes of needles meet those of many others.
constexpr std::size_t most_candidates(std::size_t triangles) {
  return std::max(std::size_t{100'000'000}, 1000 * triangles);
}

/// Sums over all parts of a search. They are integers, so their order does not matter.
struct Sums {
  std::atomic<std::size_t> candidates{0}, met{0};
};

enum class Look { apart, candidates, met };

template <class LookAt>
class Visitor {
 public:
  Visitor(const TriangleBoxes& boxes, const LookAt& look_at, Sums& sums,
          std::vector<std::array<std::uint32_t, 2>>& pairs)
      : boxes_(boxes), look_at_(look_at), sums_(sums), pairs_(pairs) {}
  Visitor(const Visitor&) = delete;
  Visitor& operator=(const Visitor&) = delete;
  ~Visitor() { sums_.candidates += candidates_; }

  bool done() const {
    return sums_.candidates.load(std::memory_order_relaxed) > most_candidates(boxes_.size());
  }

  void operator()(std::size_t i, std::size_t j) {
    const Look found = look_at_(i, j);
    if (found == Look::apart) return;
    constexpr std::size_t kOften = 1024;
    if (++candidates_ == kOften) sums_.candidates += std::exchange(candidates_, 0);
    if (found == Look::candidates || sums_.met++ >= kMostPairs) return;
    const std::uint32_t a = boxes_.triangle(i), b = boxes_.triangle(j);
    pairs_.push_back({std::min(a, b), std::max(a, b)});
  }

 private:
  const TriangleBoxes& boxes_;
  const LookAt& look_at_;
  Sums& sums_;
  std::vector<std::array<std::uint32_t, 2>>& pairs_;
  std::size_t candidates_ = 0;  ///< not yet in the sum
};

/// Calls look_at for the triangles at two positions.
template <class LookAt>
std::optional<SelfIntersections> search(const TriangleBoxes& boxes, const LookAt& look_at) {
  Sums sums;
  tbb::enumerable_thread_specific<std::vector<std::array<std::uint32_t, 2>>> of_threads;
  tbb::parallel_for(std::size_t{0}, boxes.parts(), [&](std::size_t part) {
    Visitor visitor(boxes, look_at, sums, of_threads.local());
    boxes.for_each_pair(part, visitor);
  });
  if (sums.candidates > most_candidates(boxes.size())) return std::nullopt;
  SelfIntersections result{sums.met, std::nullopt};
  if (result.count > kMostPairs) return result;
  result.pairs.emplace();
  for (const auto& pairs : of_threads)
    result.pairs->insert(result.pairs->end(), pairs.begin(), pairs.end());
  std::sort(result.pairs->begin(), result.pairs->end());
  return result;
}

/// The triangles whose boxes meet the box around those that are not known to be apart from others.
std::vector<std::uint32_t> near_others(const std::vector<Eigen::Vector3d>& vertices,
                                       const std::vector<Triangle>& triangles,
                                       const std::vector<std::uint8_t>& known_apart) {
  Eigen::AlignedBox3d others;
  for (std::size_t t = 0; t < known_apart.size(); ++t)
    if (known_apart[t] == 0) others.extend(bounds_of(vertices, triangles[t]));
  std::vector<std::uint32_t> near;
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    if (bounds_of(vertices, triangles[t]).intersects(others)) near.push_back(t);
  return near;
}

}  // namespace

std::optional<SelfIntersections> find_self_intersections(
    const std::vector<Eigen::Vector3d>& vertices, const std::vector<Triangle>& triangles,
    const std::vector<std::uint8_t>& known_apart) {
  if (triangles.size() > kMostTriangles) return std::nullopt;
  if (!known_apart.empty()) {
    const std::vector<std::uint32_t> near = near_others(vertices, triangles, known_apart);
    if (near.empty()) return SelfIntersections{0, {{}}};
    if (near.size() < triangles.size() / 2) {
      std::vector<Triangle> some(near.size());
      std::vector<std::uint8_t> some_apart(near.size());
      for (std::size_t i = 0; i < near.size(); ++i) {
        some[i] = triangles[near[i]];
        some_apart[i] = known_apart[near[i]];
      }
      auto found = find_self_intersections(vertices, some, some_apart);
      if (found && found->pairs)
        for (auto& pair : *found->pairs) pair = {near[pair[0]], near[pair[1]]};
      return found;
    }
  }
  const std::vector<std::uint32_t> fans = spread_fans(vertices, triangles, known_apart);
  for (const bool oriented : {false, true}) {
    TriangleBoxes boxes(vertices, triangles, fans, 0, oriented);
    if (!known_apart.empty()) boxes.leave_out(known_apart);
    const std::vector<Triangle> spread = spread_corners(triangles, fans, boxes);
    auto found = search(boxes, [&](std::size_t i, std::size_t j) {
      if (share_corner(spread[i], spread[j])) return Look::candidates;
      const Triangle &a = triangles[boxes.triangle(i)], &b = triangles[boxes.triangle(j)];
      if (!boxes_meet(vertices, a, b)) return Look::apart;
      return !seen_apart(vertices, a, b) && meet_elsewhere(vertices, a, b) ? Look::met
                                                                           : Look::candidates;
    });
    if (found || boxes.oriented()) return found;
  }
  return std::nullopt;
}

std::optional<std::vector<std::array<std::uint32_t, 2>>> find_pairs(
    const std::vector<Eigen::Vector3d>& vertices, const std::vector<Triangle>& triangles,
    double margin, const std::function<bool(std::uint32_t, std::uint32_t)>& wanted) {
  if (triangles.size() > kMostTriangles) return std::nullopt;
  const TriangleBoxes boxes(vertices, triangles, {}, margin);
  auto found = search(boxes, [&](std::size_t i, std::size_t j) {
    return wanted(boxes.triangle(i), boxes.triangle(j)) ? Look::met : Look::candidates;
  });
  return found ? std::move(found->pairs) : std::nullopt;
}

}  // namespace ist
