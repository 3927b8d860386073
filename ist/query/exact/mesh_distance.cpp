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

/// A box by its middle, in its own frame.
struct MiddleBox {
  double middle[3], half[3];

  double size() const noexcept { return std::max({half[0], half[1], half[2]}); }
};

MiddleBox box_of(const BoxBlock& boxes, std::uint32_t l) noexcept {
  MiddleBox box;
  for (int k = 0; k < 3; ++k) {
    box.middle[k] = 0.5 * (double{boxes.low[k][l]} + boxes.high[k][l]);
    box.half[k] = 0.5 * (double{boxes.high[k][l]} - boxes.low[k][l]);
  }
  return box;
}

/// The box of a node: of the whole mesh, or a lane of the block above.
MiddleBox box_of(const MeshTree& mesh, int level, std::uint32_t i) noexcept {
  if (level < mesh.top) return box_of(mesh.level[level + 1].boxes[i / kWidth], i % kWidth);
  MiddleBox all = box_of(mesh.level[mesh.top].boxes[0], 0);
  for (int k = 0; k < 3; ++k) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (std::uint32_t l = 0; l < mesh.level[mesh.top - 1].count; ++l) {
      low = std::min(low, double{mesh.level[mesh.top].boxes[0].low[k][l]});
      high = std::max(high, double{mesh.level[mesh.top].boxes[0].high[k][l]});
    }
    all.middle[k] = 0.5 * (low + high);
    all.half[k] = 0.5 * (high - low);
  }
  return all;
}

/// Squared distances of sixteen boxes from one of another frame, or less: along their own axes and
/// along its axes.
void gaps_of(const BoxBlock& boxes, const MiddleBox& one, const Similarity& map,
             double (&squared)[kWidth]) noexcept {
  double middle[3], hull[3], along[kWidth] = {}, across[kWidth] = {};
  map.apply(one.middle, middle);
  for (int i = 0; i < 3; ++i)
    hull[i] = (std::abs(map.m[3 * i]) * one.half[0] + std::abs(map.m[3 * i + 1]) * one.half[1]) +
              std::abs(map.m[3 * i + 2]) * one.half[2];
  double away[3][kWidth], half[3][kWidth];
  for (int i = 0; i < 3; ++i)
    for (std::uint32_t l = 0; l < kWidth; ++l) {
      away[i][l] = 0.5 * (double{boxes.low[i][l]} + boxes.high[i][l]) - middle[i];
      half[i][l] = 0.5 * (double{boxes.high[i][l]} - boxes.low[i][l]);
      const double gap = std::max(0.0, std::abs(away[i][l]) - (half[i][l] + hull[i]));
      along[l] += gap * gap;
    }
  for (int k = 0; k < 3; ++k) {
    const double x = map.m[k] / map.scale, y = map.m[3 + k] / map.scale,
                 z = map.m[6 + k] / map.scale, reach = map.scale * one.half[k];
    for (std::uint32_t l = 0; l < kWidth; ++l) {
      const double between = (x * away[0][l] + y * away[1][l]) + z * away[2][l];
      const double width = (std::abs(x) * half[0][l] + std::abs(y) * half[1][l]) +
                           std::abs(z) * half[2][l];
      const double gap = std::max(0.0, std::abs(between) - (width + reach));
      across[l] += gap * gap;
    }
  }
  for (std::uint32_t l = 0; l < kWidth; ++l) squared[l] = std::max(along[l], across[l]);
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

/// Squared distance of two triangles from one's plane, or less; 0 where it cuts the other.
double squared_height(const exact::FlatTriangle& plane, const exact::FlatTriangle& other) noexcept {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const Point& corner : other.corner) {
    const double h = dot(plane.normal, corner - plane.corner[0]);
    low = std::min(low, h);
    high = std::max(high, h);
  }
  const double height = std::max({low, -high, 0.0});
  return plane.squared_normal > 0 ? height * height / plane.squared_normal : 0;
}

class GapSearch {
 public:
  GapSearch(const MeshTree& a, const MeshTree& b, const Similarity& a_from_b,
            const Similarity& b_from_a, Budget& budget) noexcept
      : a_(a), b_(b), a_from_b_(a_from_b), b_from_a_(b_from_a), budget_(budget) {}

  MeshGap run() noexcept {
    best_.take(a_.vertex(0), map_point(a_from_b_, b_.vertex(0)));
    out_.overlap = holds({a_}, b_, {&a_from_b_}) || holds({b_, &a_from_b_, &b_from_a_}, a_, {});
    waiting_[size_++] = {0, a_.top, b_.top, 0, 0};
    double least = HUGE_VAL;
    while (size_ > 0 && !out_.overlap) {
      const Pair pair = waiting_[size_ - 1];
      if (!(pair.squared < kNearer * best_.squared)) {
        --size_;
        continue;
      }
      if (budget_.grant(1) == 0) {
        out_.stopped = true;
        for (std::uint32_t i = 0; i < size_; ++i) least = std::min(least, waiting_[i].squared);
        break;
      }
      --size_;
      if (pair.level_a == 0 && pair.level_b == 0)
        measure(pair.a, pair.b);
      else
        open(pair);
    }
    if (out_.overlap) return out_;
    out_.distance = std::sqrt(best_.squared);
    out_.a = best_.a, out_.b = best_.b;
    out_.least = std::max(0.0, (1 - 1e-12) * std::sqrt(std::min(best_.squared, least)) - slack());
    return out_;
  }

 private:
  struct Pair {
    double squared;
    int level_a, level_b;
    std::uint32_t a, b;
  };

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
  void open(const Pair& pair) noexcept {
    const MiddleBox box_a = box_of(a_, pair.level_a, pair.a),
                    box_b = box_of(b_, pair.level_b, pair.b);
    const bool open_a = pair.level_b == 0 || (pair.level_a > 0 &&
                                              box_a.size() >= a_from_b_.scale * box_b.size());
    const MeshTree& mesh = open_a ? a_ : b_;
    const int level = open_a ? pair.level_a : pair.level_b;
    const std::uint32_t number = open_a ? pair.a : pair.b;
    double squared[kWidth];
    if (open_a) {
      gaps_of(mesh.level[level].boxes[number], box_b, a_from_b_, squared);
    } else {
      gaps_of(mesh.level[level].boxes[number], box_a, b_from_a_, squared);
      for (double& gap : squared) gap *= a_from_b_.scale * a_from_b_.scale;
    }
    const std::uint32_t used = std::min(kWidth, mesh.level[level - 1].count - kWidth * number);
    const std::uint32_t first = size_;
    for (std::uint32_t l = 0; l < used; ++l) {
      if (!(squared[l] < kNearer * best_.squared)) continue;
      Pair child = pair;
      child.squared = std::max(pair.squared, squared[l]);
      (open_a ? child.a : child.b) = kWidth * number + l;
      --(open_a ? child.level_a : child.level_b);
      std::uint32_t place = size_++;
      for (; place > first && waiting_[place - 1].squared < child.squared; --place)
        waiting_[place] = waiting_[place - 1];
      waiting_[place] = child;
    }
  }

  void measure(std::uint32_t a, std::uint32_t b) noexcept {
    placed_a_.place(a_, a, nullptr);
    placed_b_.place(b_, b, &a_from_b_);
    near_vertices();
    for (std::uint32_t t = 0; t < placed_a_.block->triangles && !out_.overlap; ++t) {
      if (!(squared_gap(placed_b_.all_low, placed_b_.all_high, placed_a_, t) < best_.squared))
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
      for (std::uint32_t l = 0; l < placed_b_.block->triangles && !out_.overlap; ++l)
        if (squared[l] < best_.squared) measure(of_a, placed_b_.triangle(l), squared[l]);
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

  void measure(const exact::FlatTriangle& a, const exact::FlatTriangle& b,
               double boxes_gap) noexcept {
    const double over_a = squared_height(a, b);
    if (!(kNearer * over_a < best_.squared)) return;
    const double over_b = squared_height(b, a);
    if (!(kNearer * over_b < best_.squared)) return;
    ++out_.tests;
    if (boxes_gap == 0 && over_a == 0 && over_b == 0 &&
        exact::cross_exactly(a.corner, b.corner).pierced != 0) {
      out_.overlap = true;
      return;
    }
    exact::take_nearest(a, b, best_);
    for (const exact::FlatTriangle* t : {&a, &b}) {
      const double longest = std::max({dot(t->side[0], t->side[0]), dot(t->side[1], t->side[1]),
                                       dot(t->side[2], t->side[2])});
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
  std::uint32_t size_ = 0;
  Pair waiting_[2 * kWidth * kMaxLevels];
};

}  // namespace

MeshGap mesh_gap(const MeshTree& a, const MeshTree& b, const Similarity& a_from_b,
                 const Similarity& b_from_a, Budget& budget) noexcept {
  return GapSearch(a, b, a_from_b, b_from_a, budget).run();
}

}  // namespace ist
