#include "bake/cluster/depth_kernel.h"

#include <algorithm>
#include <array>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/cluster/depth_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef IST_BAKE_DEPTH_KERNEL_ONCE
#define IST_BAKE_DEPTH_KERNEL_ONCE
namespace ist {

inline double square_of(double x) { return x * x; }

/// A little more than the radius: errs on the side of meeting, by more than rounding.
inline double enlarged(double radius) { return radius * (1 + 1e-9) + 1e-12; }

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
  int passed;        ///< boxes that were not worth keeping, whose turn is just before this one's
  std::size_t most;  ///< balls that meet it
};

/// Whether balls and boxes meet, one in each lane.
HWY_INLINE hn::Mask<Tag> meets(Vector dx, Vector dy, Vector dz, Vector half, Vector reach2) {
  const Vector none = hn::Zero(Tag());
  dx = hn::Max(hn::Abs(dx) - half, none);
  dy = hn::Max(hn::Abs(dy) - half, none);
  dz = hn::Max(hn::Abs(dz) - half, none);
  return (dx * dx + dy * dy) + dz * dz <= reach2;
}

/// The eight halves of a box, and what meets them.
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

  /// How many of the others meet half c; 0 where `home` does not.
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
      found = box.most;  // gives up here: the bound stays true
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

void CoveringBalls::clear() {
  for (std::vector<double>* const values : {&x, &y, &z, &reach2, &radius2}) values->clear();
}

void CoveringBalls::add(const Ball& ball) {
  x.push_back(ball.x);
  y.push_back(ball.y);
  z.push_back(ball.z);
  reach2.push_back(square_of(enlarged(ball.r)));
  radius2.push_back(square_of(ball.r));
}

HWY_EXPORT(deepest);

std::size_t deepest(const Ball& home, const CoveringBalls& others) {
  return HWY_DYNAMIC_DISPATCH(deepest)(home, others);
}

}  // namespace ist
#endif
