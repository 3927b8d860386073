#include "query/exact/mesh_distance.h"

#include <algorithm>

#include "query/exact/crossing.h"
#include "query/exact/mesh_queries.h"
#include "query/exact/nearest_points.h"

namespace ist {
namespace {

using exact::Point;

/// What is no nearer than the best by more than this, relative, need not be looked at.
constexpr double kNearer = 1 - 1e-13;

/// A box by its middle and its slab, in its own frame.
struct MiddleBox {
  double middle[3], half[3];
  double normal[3] = {}, slab_low = 0, slab_high = 0;

  double size() const noexcept { return std::max({half[0], half[1], half[2]}); }
};

MiddleBox box_of(const BoxBlock& boxes, std::uint32_t l) noexcept {
  MiddleBox box;
  for (int k = 0; k < 3; ++k) {
    box.middle[k] = 0.5 * (double{boxes.low[k][l]} + boxes.high[k][l]);
    box.half[k] = 0.5 * (double{boxes.high[k][l]} - boxes.low[k][l]);
    box.normal[k] = boxes.normal[k][l];
  }
  box.slab_low = boxes.slab_low[l], box.slab_high = boxes.slab_high[l];
  return box;
}

/// The box of a node: a lane of the block above, or that of the whole mesh, which has no slab.
MiddleBox box_of(const MeshTree& mesh, int level, std::uint32_t i) noexcept {
  if (level < mesh.top) return box_of(mesh.level[level + 1].boxes[i / kWidth], i % kWidth);
  MiddleBox all;
  const BoxBlock& root = mesh.level[mesh.top].boxes[0];
  const std::uint32_t used = mesh.level[mesh.top - 1].count;
  for (int k = 0; k < 3; ++k) {
    const double low = *std::min_element(root.low[k], root.low[k] + used);
    const double high = *std::max_element(root.high[k], root.high[k] + used);
    all.middle[k] = 0.5 * (low + high);
    all.half[k] = 0.5 * (high - low);
  }
  return all;
}

/// Squared distances of sixteen boxes from one of another frame, or less: along their own axes,
/// along its axes, along the normals of all slabs, and along the unit vector `toward` it.
void gaps_of(const BoxBlock& boxes, const MiddleBox& one, const Similarity& map,
             const double (&toward)[3], double (&squared)[kWidth]) noexcept {
  double middle[3], hull[3], axis[3][3], reach[3], normal[3];
  map.apply(one.middle, middle);
  for (int i = 0; i < 3; ++i) {
    hull[i] = (std::abs(map.m[3 * i]) * one.half[0] + std::abs(map.m[3 * i + 1]) * one.half[1]) +
              std::abs(map.m[3 * i + 2]) * one.half[2];
    for (int k = 0; k < 3; ++k) axis[k][i] = map.m[3 * i + k] / map.scale;
    reach[i] = map.scale * one.half[i];
  }
  for (int i = 0; i < 3; ++i)
    normal[i] =
        (axis[0][i] * one.normal[0] + axis[1][i] * one.normal[1]) + axis[2][i] * one.normal[2];
  // Its slab from its middle; all below is told from there.
  const double before = (one.normal[0] * one.middle[0] + one.normal[1] * one.middle[1]) +
                        one.normal[2] * one.middle[2];
  const double low = map.scale * (one.slab_low - before),
               high = map.scale * (one.slab_high - before);
  // How far it reaches back along `toward`.
  const double turned = (toward[0] * normal[0] + toward[1] * normal[1]) + toward[2] * normal[2];
  double by_box = 0, by_slab = std::min(turned * low, turned * high);
  for (int k = 0; k < 3; ++k) {
    const double x = toward[0] * axis[k][0] + toward[1] * axis[k][1] + toward[2] * axis[k][2];
    by_box -= reach[k] * std::abs(x);
    by_slab -= reach[k] * std::abs(x - turned * one.normal[k]);
  }
  const double nearest = std::max(by_box, by_slab);
  double away[3][kWidth], half[3][kWidth], along[kWidth] = {}, across[kWidth] = {};
  for (int i = 0; i < 3; ++i)
    for (std::uint32_t l = 0; l < kWidth; ++l) {
      away[i][l] = 0.5 * (double{boxes.low[i][l]} + boxes.high[i][l]) - middle[i];
      half[i][l] = 0.5 * (double{boxes.high[i][l]} - boxes.low[i][l]);
      const double gap = std::max(0.0, std::abs(away[i][l]) - (half[i][l] + hull[i]));
      along[l] += gap * gap;
    }
  for (int k = 0; k < 3; ++k)
    for (std::uint32_t l = 0; l < kWidth; ++l) {
      const double* const u = axis[k];
      const double between = (u[0] * away[0][l] + u[1] * away[1][l]) + u[2] * away[2][l];
      const double width =
          (std::abs(u[0]) * half[0][l] + std::abs(u[1]) * half[1][l]) + std::abs(u[2]) * half[2][l];
      const double gap = std::max(0.0, std::abs(between) - (width + reach[k]));
      across[l] += gap * gap;
    }
  for (std::uint32_t l = 0; l < kWidth; ++l) {
    const double n[3] = {boxes.normal[0][l], boxes.normal[1][l], boxes.normal[2][l]};
    // n is `turn` times the other normal and a rest, by which only boxes are known.
    const double turn = (n[0] * normal[0] + n[1] * normal[1]) + n[2] * normal[2];
    const double steep = (n[0] * toward[0] + n[1] * toward[1]) + n[2] * toward[2];
    double rest[3], other_rest[3], at_middle = 0, at_box = 0, other_at_box = 0, to_box = 0;
    double ahead = 0, ahead_of_slab = 0;
    for (int i = 0; i < 3; ++i) {
      ahead += toward[i] * away[i][l] + std::abs(toward[i]) * half[i][l];
      const double beside = toward[i] - steep * n[i];
      ahead_of_slab += beside * away[i][l] + std::abs(beside) * half[i][l];
      rest[i] = n[i] - turn * normal[i];
      other_rest[i] = normal[i] - turn * n[i];
      at_middle += n[i] * middle[i];
      other_at_box += std::abs(other_rest[i]) * half[i][l];
      to_box += other_rest[i] * away[i][l];
    }
    for (int k = 0; k < 3; ++k)
      at_box +=
          reach[k] * std::abs((axis[k][0] * rest[0] + axis[k][1] * rest[1]) + axis[k][2] * rest[2]);
    // Along n, from the one's middle: it, and the lane's slab.
    const double slab_low = boxes.slab_low[l] - at_middle,
                 slab_high = boxes.slab_high[l] - at_middle;
    const double gap = std::max(slab_low - (std::max(turn * low, turn * high) + at_box),
                                (std::min(turn * low, turn * high) - at_box) - slab_high);
    const double most = to_box + std::max(turn * slab_low, turn * slab_high) + other_at_box;
    const double least = to_box + std::min(turn * slab_low, turn * slab_high) - other_at_box;
    const double other_gap = std::max(low - most, least - high);
    constexpr double kLength = 1 - 1e-5;  // of normals, or more
    const double slabs = kLength * std::max({0.0, gap, other_gap});
    ahead_of_slab += std::max(steep * slab_low, steep * slab_high);
    const double ahead_gap = std::max(0.0, nearest - std::min(ahead, ahead_of_slab));
    squared[l] = std::max({along[l], across[l], slabs * slabs, ahead_gap * ahead_gap});
  }
}

/// A block's triangles in A's unit frame.
struct PlacedBlock {
  std::uint32_t number = ~0u;
  const MeshBlock* block;
  double vertex[3][kWidth];
  double low[3][kWidth], high[3][kWidth];  ///< of triangles; of unused lanes those of the first
  double all_low[3], all_high[3];

  void place(const MeshTree& mesh, std::uint32_t i, const Similarity* map) noexcept {
    if (number == i) return;
    number = i;
    block = &mesh.blocks[i];
    for (std::uint32_t v = 0; v < kWidth; ++v) {
      Point x = mesh.vertex(block->vertex[v]);
      if (map != nullptr) x = map_point(*map, x);
      vertex[0][v] = x.x, vertex[1][v] = x.y, vertex[2][v] = x.z;
    }
    for (int k = 0; k < 3; ++k) {
      for (std::uint32_t t = 0; t < kWidth; ++t) {
        const std::uint32_t lane = t < block->triangles ? t : 0;
        const double x = vertex[k][block->corner[0][lane]], y = vertex[k][block->corner[1][lane]],
                     z = vertex[k][block->corner[2][lane]];
        low[k][t] = std::min(x, std::min(y, z));
        high[k][t] = std::max(x, std::max(y, z));
      }
      all_low[k] = *std::min_element(vertex[k], vertex[k] + kWidth);
      all_high[k] = *std::max_element(vertex[k], vertex[k] + kWidth);
    }
  }
  void look_along(const Point& w, double (&along)[kWidth]) const noexcept {
    for (std::uint32_t v = 0; v < kWidth; ++v)
      along[v] = (w.x * vertex[0][v] + w.y * vertex[1][v]) + w.z * vertex[2][v];
  }
  Point at(std::uint32_t v) const noexcept { return {vertex[0][v], vertex[1][v], vertex[2][v]}; }
  exact::FlatTriangle triangle(std::uint32_t t) const noexcept {
    return exact::FlatTriangle(at(block->corner[0][t]), at(block->corner[1][t]),
                               at(block->corner[2][t]));
  }
};

double squared_gap(const double* low, const double* high, const PlacedBlock& of,
                   std::uint32_t t) noexcept {
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double gap = std::max({of.low[k][t] - high[k], low[k] - of.high[k][t], 0.0});
    sum += gap * gap;
  }
  return sum;
}

class GapSearch {
 public:
  GapSearch(const MeshTree& a, const MeshTree& b, const Similarity& a_from_b,
            const Similarity& b_from_a, Budget& budget, ExactScratch& scratch) noexcept
      : a_(a),
        b_(b),
        a_from_b_(a_from_b),
        b_from_a_(b_from_a),
        budget_(budget),
        waiting_(scratch.gaps.get()) {}

  MeshGap run() noexcept {
    best_.take(a_.vertex(0), map_point(a_from_b_, b_.vertex(0)));
    out_.overlap = holds({a_}, b_, {&a_from_b_}) || holds({b_, &a_from_b_, &b_from_a_}, a_, {});
    push({0, 0, 0, static_cast<std::uint8_t>(a_.top), static_cast<std::uint8_t>(b_.top)});
    double least = 0;
    while (size_ > 0 && !out_.overlap && !out_.stopped) {
      const GapPair pair = waiting_[0];
      least = pair.squared;
      if (!(least < kNearer * best_.squared)) break;
      std::pop_heap(waiting_, waiting_ + size_--);
      // Behind a full heap all below the pair waits on a stack, and comes before the rest.
      const std::uint32_t heap = size_;
      depth_first_ = heap >= ExactScratch::kMostGaps;
      visit(pair);
      while (depth_first_ && size_ > heap && !out_.overlap && !out_.stopped)
        visit(waiting_[--size_]);
    }
    if (!out_.stopped) least = best_.squared;
    if (out_.overlap) return out_;
    out_.distance = std::sqrt(best_.squared);
    out_.a = best_.a, out_.b = best_.b;
    out_.least = std::max(0.0, (1 - 1e-12) * std::sqrt(least) - slack());
    return out_;
  }

 private:
  void push(const GapPair& pair) noexcept {
    waiting_[size_++] = pair;
    if (!depth_first_) std::push_heap(waiting_, waiting_ + size_);
  }

  void visit(GapPair pair) noexcept {
    if (!(pair.squared < kNearer * best_.squared)) return;
    out_.stopped = budget_.grant(1) == 0;
    if (out_.stopped) return;
    if (pair.level_a == 0 && pair.level_b == 0)
      measure(pair.a, pair.b);
    else
      open(pair);
  }

  /// Whether a solid holds a shell of the other.
  struct ShellMap {
    const Similarity* to_a = nullptr;
  };
  static bool holds(const MeshOfPair& solid, const MeshTree& other, const ShellMap& map) noexcept {
    for (std::uint32_t s = 0; s < other.header->shell_count; ++s) {
      const Point x = other.vertex(other.blocks[other.shells[s].block].vertex[0]);
      if (is_inside(solid, map.to_a != nullptr ? map_point(*map.to_a, x) : x)) return true;
    }
    return false;
  }

  /// What distances are off by, by rounding: of coordinates, and of thin triangles.
  double slack() const noexcept {
    double shift = 0;
    for (const double t : a_from_b_.t) shift = std::max(shift, std::abs(t));
    return 1e-14 * ((a_.extent() + a_from_b_.scale * b_.extent()) + shift) + thin_;
  }

  /// The larger node's sixteen against the other's box.
  void open(const GapPair& pair) noexcept {
    const MiddleBox box_a = box_of(a_, pair.level_a, pair.a),
                    box_b = box_of(b_, pair.level_b, pair.b);
    const bool open_a =
        pair.level_b == 0 || (pair.level_a > 0 && box_a.size() >= a_from_b_.scale * box_b.size());
    const MeshTree& mesh = open_a ? a_ : b_;
    const int level = open_a ? pair.level_a : pair.level_b;
    const std::uint32_t number = open_a ? pair.a : pair.b;
    double squared[kWidth];
    const Point w = best_.direction();
    if (open_a) {
      gaps_of(mesh.level[level].boxes[number], box_b, a_from_b_, {w.x, w.y, w.z}, squared);
    } else {
      double back[3];
      for (int i = 0; i < 3; ++i)
        back[i] = -((b_from_a_.m[3 * i] * w.x + b_from_a_.m[3 * i + 1] * w.y) +
                    b_from_a_.m[3 * i + 2] * w.z) /
                  b_from_a_.scale;
      gaps_of(mesh.level[level].boxes[number], box_a, b_from_a_, back, squared);
      for (double& gap : squared) gap *= a_from_b_.scale * a_from_b_.scale;
    }
    const std::uint32_t used = std::min(kWidth, mesh.level[level - 1].count - kWidth * number);
    const std::uint32_t first = size_;
    for (std::uint32_t l = 0; l < used; ++l) {
      if (!(squared[l] < kNearer * best_.squared)) continue;
      GapPair child = pair;
      child.squared = std::max(pair.squared, squared[l]);
      (open_a ? child.a : child.b) = kWidth * number + l;
      --(open_a ? child.level_a : child.level_b);
      push(child);
    }
    if (depth_first_) std::sort(waiting_ + first, waiting_ + size_);
  }

  void measure(std::uint32_t a, std::uint32_t b) noexcept {
    placed_a_.place(a_, a, nullptr);
    placed_b_.place(b_, b, &a_from_b_);
    // Along the way between the nearest points so far nothing else may be nearer: then that is all.
    const Point w = best_.direction();
    double along_a[kWidth], along_b[kWidth];
    placed_a_.look_along(w, along_a);
    placed_b_.look_along(w, along_b);
    const double first_b = *std::min_element(along_b, along_b + kWidth);
    if (apart(first_b - *std::max_element(along_a, along_a + kWidth))) return;
    near_vertices();
    double ahead_b[kWidth];
    const auto& corner_a = placed_a_.block->corner;
    const auto& corner_b = placed_b_.block->corner;
    for (std::uint32_t l = 0; l < kWidth; ++l)
      ahead_b[l] =
          std::min({along_b[corner_b[0][l]], along_b[corner_b[1][l]], along_b[corner_b[2][l]]});
    for (std::uint32_t t = 0; t < placed_a_.block->triangles && !out_.overlap; ++t) {
      const double ahead =
          std::max({along_a[corner_a[0][t]], along_a[corner_a[1][t]], along_a[corner_a[2][t]]});
      if (apart(first_b - ahead) ||
          !(squared_gap(placed_b_.all_low, placed_b_.all_high, placed_a_, t) < best_.squared))
        continue;
      double squared[kWidth] = {};
      for (int k = 0; k < 3; ++k) {
        const double low = placed_a_.low[k][t], high = placed_a_.high[k][t];
        for (std::uint32_t l = 0; l < kWidth; ++l) {
          const double gap =
              std::max(0.0, std::max(placed_b_.low[k][l] - high, low - placed_b_.high[k][l]));
          squared[l] += gap * gap;
        }
      }
      const exact::FlatTriangle of_a = placed_a_.triangle(t);
      const exact::Point& n = of_a.normal;
      double height[kWidth];
      for (std::uint32_t v = 0; v < kWidth; ++v)
        height[v] = (n.x * (placed_b_.vertex[0][v] - of_a.corner[0].x) +
                     n.y * (placed_b_.vertex[1][v] - of_a.corner[0].y)) +
                    n.z * (placed_b_.vertex[2][v] - of_a.corner[0].z);
      for (std::uint32_t l = 0; l < placed_b_.block->triangles && !out_.overlap; ++l)
        if (squared[l] < best_.squared && !apart(ahead_b[l] - ahead))
          measure(of_a, l, squared[l],
                  {height[corner_b[0][l]], height[corner_b[1][l]], height[corner_b[2][l]]});
    }
  }

  /// Two vertices bound the distance well before any triangles are measured.
  void near_vertices() noexcept {
    for (std::uint32_t v = 0; v < placed_a_.block->vertices; ++v) {
      double squared[kWidth] = {};
      for (int k = 0; k < 3; ++k)
        for (std::uint32_t l = 0; l < kWidth; ++l) {
          const double between = placed_b_.vertex[k][l] - placed_a_.vertex[k][v];
          squared[l] += between * between;
        }
      const auto nearest = std::min_element(squared, squared + kWidth);
      if (*nearest < best_.squared)
        best_.take(placed_a_.at(v), placed_b_.at(static_cast<std::uint32_t>(nearest - squared)));
    }
  }

  bool apart(double gap) const noexcept {
    return gap > 0 && !(kNearer * (gap * gap) < best_.squared);
  }

  /// Of three heights, times the normal's length: whether a plane is further than the best.
  bool beyond(const exact::Heights& height, double squared_normal) const noexcept {
    const double least = std::max(std::min({height[0], height[1], height[2]}),
                                  -std::max({height[0], height[1], height[2]}));
    return least > 0 && kNearer * (least * least) > best_.squared * squared_normal;
  }

  void measure(const exact::FlatTriangle& a, std::uint32_t lane, double boxes_gap,
               const exact::Heights& over_a) noexcept {
    if (beyond(over_a, a.squared_normal)) return;
    const exact::FlatTriangle b = placed_b_.triangle(lane);
    exact::Heights over_b;
    for (int k = 0; k < 3; ++k) over_b[k] = dot(b.normal, a.corner[k] - b.corner[0]);
    if (beyond(over_b, b.squared_normal)) return;
    ++out_.tests;
    if (boxes_gap == 0 && exact::cross_exactly(a.corner, b.corner)) {
      out_.overlap = true;
      return;
    }
    exact::take_nearest(a, b, over_a, over_b, best_);
    for (const exact::FlatTriangle* t : {&a, &b}) {
      const double longest = std::max(
          {dot(t->side[0], t->side[0]), dot(t->side[1], t->side[1]), dot(t->side[2], t->side[2])});
      // A foot is off by a rounding over the angle, or by the width.
      if (t->squared_normal < 1e-4 * longest * longest && t->squared_normal > 0) {
        const double width = std::sqrt(t->squared_normal / longest);
        thin_ = std::max(thin_, std::min(width, 1e-14 * longest / width));
      }
    }
  }

  const MeshTree& a_;
  const MeshTree& b_;
  const Similarity& a_from_b_;
  const Similarity& b_from_a_;
  Budget& budget_;
  exact::NearestPair best_;
  MeshGap out_;
  double thin_ = 0;
  PlacedBlock placed_a_, placed_b_;
  GapPair* const waiting_;  ///< a heap
  std::uint32_t size_ = 0;
  bool depth_first_ = false;
};

}  // namespace

MeshGap mesh_gap(const MeshTree& a, const MeshTree& b, const Similarity& a_from_b,
                 const Similarity& b_from_a, Budget& budget, ExactScratch& scratch) noexcept {
  return GapSearch(a, b, a_from_b, b_from_a, budget, scratch).run();
}

}  // namespace ist
