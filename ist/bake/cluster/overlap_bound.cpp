#include "bake/cluster/ball_lanes.h"

#include <ist/asset_layout.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/cluster/overlap_bound.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef IST_BAKE_OVERLAP_BOUND_ONCE
#define IST_BAKE_OVERLAP_BOUND_ONCE
namespace ist {

inline double square_of(double x) { return x * x; }

/// Slightly more than the radius: errs towards overlap, by more than rounding.
inline double enlarged(double radius) { return radius * (1 + 1e-9) + 1e-12; }

struct CoveringBalls {
  std::vector<double> x, y, z;
  std::vector<double> reach2;   ///< slightly more than the radius, squared
  std::vector<double> radius2;  ///< the radius squared

  std::size_t size() const { return x.size(); }
  void clear() {
    for (std::vector<double>* const values : {&x, &y, &z, &reach2, &radius2}) values->clear();
  }
  void add(const Ball& ball) {
    x.push_back(ball.x);
    y.push_back(ball.y);
    z.push_back(ball.z);
    reach2.push_back(square_of(enlarged(ball.r)));
    radius2.push_back(square_of(ball.r));
  }
};

}  // namespace ist
#endif

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<double, 8>;
using Vector = hn::Vec<Tag>;

// A box is subdivided while more balls meet it than are known to cover one point.
constexpr int kBoxBudget = 600;
constexpr int kMaxDepth = 6;
constexpr std::size_t kHalves = 8;

struct Box {
  double x, y, z, half;
  int depth;
  int passed;        ///< boxes that were dropped and preceded this one in the order
  std::size_t most;  ///< balls that meet it
};

/// Tests whether balls and boxes meet, one in each lane.
HWY_INLINE hn::Mask<Tag> meets(Vector dx, Vector dy, Vector dz, Vector half, Vector reach2) {
  const Vector none = hn::Zero(Tag());
  dx = hn::Max(hn::Abs(dx) - half, none);
  dy = hn::Max(hn::Abs(dy) - half, none);
  dz = hn::Max(hn::Abs(dz) - half, none);
  return (dx * dx + dy * dy) + dz * dz <= reach2;
}

/// The eight octants of a box, and the balls that meet them.
class Halves {
 public:
  explicit Halves(const Box& box) : half_(box.half / 2) {
    for (std::size_t c = 0; c < kHalves; ++c) {
      x_[c] = box.x + ((c & 1) != 0 ? half_ : -half_);
      y_[c] = box.y + ((c & 2) != 0 ? half_ : -half_);
      z_[c] = box.z + ((c & 4) != 0 ? half_ : -half_);
    }
  }

  void count(const Ball& home, const CoveringBalls& others) {
    const Tag d;
    const Vector half = hn::Set(d, half_), one = hn::Set(d, 1.0);
    const Vector home_reach2 = hn::Set(d, square_of(enlarged(home.r)));
    for (std::size_t c = 0; c < kHalves; c += hn::Lanes(d)) {
      const Vector x = hn::Load(d, x_.data() + c), y = hn::Load(d, y_.data() + c),
                   z = hn::Load(d, z_.data() + c);
      Vector count = hn::Zero(d);
      for (std::size_t i = 0; i < others.size(); ++i) {
        const auto met = meets(hn::Set(d, others.x[i]) - x, hn::Set(d, others.y[i]) - y,
                               hn::Set(d, others.z[i]) - z, half, hn::Set(d, others.reach2[i]));
        count = count + hn::IfThenElseZero(met, one);
      }
      const auto met = meets(hn::Set(d, home.x) - x, hn::Set(d, home.y) - y, hn::Set(d, home.z) - z,
                             half, home_reach2);
      hn::Store(hn::IfThenElseZero(met, count), d, counts_.data() + c);
    }
  }

  /// The number of other balls that meet octant c; 0 if `home` does not.
  std::size_t most(std::size_t c) const { return static_cast<std::size_t>(counts_[c]); }
  Box box(std::size_t c, int depth) const {
    return {x_[c], y_[c], z_[c], half_, depth, 0, most(c)};
  }

 private:
  double half_;
  alignas(64) std::array<double, kHalves> x_, y_, z_, counts_;
};

std::size_t covering(const CoveringBalls& others, const Box& box) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < others.size(); ++i)
    count += square_of(others.x[i] - box.x) + square_of(others.y[i] - box.y) +
                 square_of(others.z[i] - box.z) <=
             others.radius2[i];
  return count;
}

/// Upper bound on the number of `others`, each of which meets `home`, that cover one point of it.
std::size_t deepest(const Ball& home, const CoveringBalls& others) {
  if (others.size() == 0) return 0;
  const auto in_home = [&](const Box& box) {
    return square_of(home.x - box.x) + square_of(home.y - box.y) + square_of(home.z - box.z) <=
           square_of(home.r);
  };
  std::size_t found = 1;  // each of them meets `home`, to rounding
  std::array<Box, 8 * (kMaxDepth + 1)> stack;
  std::size_t size = 0;
  stack[size++] = {home.x, home.y, home.z, enlarged(home.r), 0, 0, others.size()};
  for (int spent = 0; size > 0; ++spent) {
    const Box box = stack[--size];
    spent += box.passed;
    if (box.most <= found) continue;
    if (in_home(box)) {
      found = std::max(found, covering(others, box));
      if (box.most <= found) continue;
    }
    if (box.depth == kMaxDepth || spent >= kBoxBudget) {
      found = box.most;  // gives up: the bound remains valid
      continue;
    }
    Halves halves(box);
    halves.count(home, others);
    int passed = 0;
    const auto pass = [&] {
      if (size > 0) stack[size - 1].passed += passed;
      passed = 0;
    };
    for (std::size_t c = 0; c < kHalves; ++c) {
      if (halves.most(c) <= found) {
        ++passed;
        continue;
      }
      pass();
      stack[size++] = halves.box(c, box.depth + 1);
    }
    pass();
  }
  return found;
}

}  // namespace
}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {
namespace {

HWY_EXPORT(deepest);

// A point that many spheres cover lies in the smallest of them. So it suffices to search, inside
// every sphere, for the point that most larger ones cover.

class OverlapBounds {
 public:
  OverlapBounds(std::span<const Ball> spheres, const std::vector<std::vector<Ball>>& balls)
      : spheres_(spheres), balls_(balls) {}

  struct Scratch {
    std::vector<std::size_t> larger;
    CoveringBalls others;
  };

  /// For one sphere, 1 + deepest() among larger spheres of each of its ancestors and of the set.
  void around(std::size_t i, std::span<float> depth, Scratch& scratch) const {
    auto& [larger, others] = scratch;
    larger.clear();
    others.clear();
    collect(i, balls_.size(), 0, larger);
    for (std::size_t k = 0; k < depth.size(); ++k) {
      const auto group = [&](std::size_t j) { return k < balls_.size() ? j >> (4 * (k + 1)) : 0; };
      const std::size_t before = others.size();
      others.clear();
      for (const std::size_t j : larger)
        if (group(j) == group(i)) others.add(spheres_[j]);
      const bool same = k > 0 && others.size() == before;
      depth[k] = same ? depth[k - 1]
                      : 1 + static_cast<float>(HWY_DYNAMIC_DISPATCH(deepest)(spheres_[i], others));
    }
  }

 private:
  static bool overlap(const Ball& a, const Ball& b) {
    return square_of(a.x - b.x) + square_of(a.y - b.y) + square_of(a.z - b.z) <=
           square_of((a.r + b.r) * (1 + 1e-9) + 1e-12);
  }

  bool is_larger(std::size_t j, std::size_t i) const {
    return spheres_[j].r != spheres_[i].r ? spheres_[j].r > spheres_[i].r : j < i;
  }

  /// Collects larger spheres that overlap sphere i, from the children of one node down.
  void collect(std::size_t i, std::size_t level, std::size_t node,
               std::vector<std::size_t>& out) const {
    const std::size_t begin = level == balls_.size() ? 0 : node * kWidth;
    if (level == 0) {
      for (std::size_t j = begin; j < std::min(begin + kWidth, spheres_.size()); ++j)
        if (is_larger(j, i) && overlap(spheres_[i], spheres_[j])) out.push_back(j);
      return;
    }
    const std::vector<Ball>& below = balls_[level - 1];
    const std::size_t end =
        level == balls_.size() ? below.size() : std::min(begin + kWidth, below.size());
    for (std::size_t child = begin; child < end; ++child)
      if (overlap(spheres_[i], below[child])) collect(i, level - 1, child, out);
  }

  std::span<const Ball> spheres_;
  const std::vector<std::vector<Ball>>& balls_;
};

}  // namespace

std::vector<std::vector<float>> overlap_bounds(std::span<const Ball> spheres,
                                               const std::vector<std::vector<Ball>>& balls) {
  const OverlapBounds bounds(spheres, balls);
  const std::size_t levels = balls.size() + 1;
  std::vector<float> around(spheres.size() * levels);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, spheres.size(), kWidth),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      OverlapBounds::Scratch scratch;
                      for (std::size_t i = range.begin(); i < range.end(); ++i)
                        bounds.around(i, std::span(around).subspan(i * levels, levels), scratch);
                    });
  std::vector<std::vector<float>> kappa;
  kappa.reserve(balls.size() + 1);
  for (const auto& level : balls) kappa.emplace_back(level.size(), 1.0f);
  kappa.push_back({1.0f});
  for (std::size_t i = 0; i < spheres.size(); ++i)
    for (std::size_t k = 0; k < kappa.size(); ++k) {
      float& bound = kappa[k][k < balls.size() ? i >> (4 * (k + 1)) : 0];
      bound = std::max(bound, around[i * levels + k]);
    }
  return kappa;
}

}  // namespace ist
#endif
