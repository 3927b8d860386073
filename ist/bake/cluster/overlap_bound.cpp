#include "bake/cluster/overlap_bound.h"

#include <tbb/parallel_for.h>
#include <algorithm>
#include <array>
#include <cmath>

#include <ist/asset_layout.h>

namespace ist {
namespace {

// A point that many spheres cover lies in the smallest of them: it is enough to look, inside every
// sphere, for the point that most larger ones cover. Boxes are subdivided while their count of
// spheres that meet them exceeds the best count found at a point.
constexpr int kBoxBudget = 600;
constexpr int kMaxDepth = 6;

struct Box {
  double x, y, z, half;
  int depth;
};

double squared(double x) { return x * x; }

/// Errs on the side of meeting, by more than rounding.
bool meets(const Ball& ball, const Box& box) {
  const double dx = std::fmax(std::fabs(ball.x - box.x) - box.half, 0);
  const double dy = std::fmax(std::fabs(ball.y - box.y) - box.half, 0);
  const double dz = std::fmax(std::fabs(ball.z - box.z) - box.half, 0);
  return dx * dx + dy * dy + dz * dz <= squared(ball.r * (1 + 1e-9) + 1e-12);
}

bool contains(const Ball& ball, const Box& box) {
  return squared(ball.x - box.x) + squared(ball.y - box.y) + squared(ball.z - box.z) <=
         squared(ball.r);
}

/// Upper bound on how many of `others` cover one point of `home`.
std::size_t deepest(const Ball& home, std::span<const Ball> others) {
  if (others.empty()) return 0;
  std::size_t found = 1;  // each of them meets `home`, to rounding
  std::vector<Box> stack = {{home.x, home.y, home.z, home.r * (1 + 1e-9) + 1e-12, 0}};
  for (int spent = 0; !stack.empty(); ++spent) {
    const Box box = stack.back();
    stack.pop_back();
    if (!meets(home, box)) continue;
    std::size_t most = 0;
    for (const Ball& ball : others) most += meets(ball, box);
    if (most <= found) continue;
    if (contains(home, box)) {
      std::size_t here = 0;
      for (const Ball& ball : others) here += contains(ball, box);
      found = std::max(found, here);
      if (most <= found) continue;
    }
    if (box.depth == kMaxDepth || spent >= kBoxBudget) {
      found = most;  // gives up here: the bound stays true
      continue;
    }
    const double h = box.half / 2;
    for (int c = 0; c < 8; ++c)
      stack.push_back({box.x + ((c & 1) != 0 ? h : -h), box.y + ((c & 2) != 0 ? h : -h),
                       box.z + ((c & 4) != 0 ? h : -h), h, box.depth + 1});
  }
  return found;
}

class OverlapBounds {
 public:
  OverlapBounds(std::span<const Ball> spheres, const std::vector<std::vector<Ball>>& balls)
      : spheres_(spheres), balls_(balls) {}

  /// For one sphere, 1 + deepest() among larger spheres of each of its ancestors and of the set.
  std::vector<std::size_t> around(std::size_t i) const {
    std::vector<std::size_t> larger;
    collect(i, balls_.size(), 0, larger);
    std::vector<std::size_t> depth(balls_.size() + 1);
    std::vector<Ball> others;
    for (std::size_t k = 0; k < depth.size(); ++k) {
      const auto group = [&](std::size_t j) { return k < balls_.size() ? j >> (4 * (k + 1)) : 0; };
      const std::size_t before = others.size();
      others.clear();
      for (const std::size_t j : larger)
        if (group(j) == group(i)) others.push_back(spheres_[j]);
      const bool same = k > 0 && others.size() == before;
      depth[k] = same ? depth[k - 1] : 1 + deepest(spheres_[i], others);
    }
    return depth;
  }

 private:
  static bool overlap(const Ball& a, const Ball& b) {
    return squared(a.x - b.x) + squared(a.y - b.y) + squared(a.z - b.z) <=
           squared((a.r + b.r) * (1 + 1e-9) + 1e-12);
  }

  bool is_larger(std::size_t j, std::size_t i) const {
    return spheres_[j].r != spheres_[i].r ? spheres_[j].r > spheres_[i].r : j < i;
  }

  /// Larger spheres that overlap sphere i, from the children of one node down.
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
  std::vector<std::vector<std::size_t>> around(spheres.size());
  tbb::parallel_for(std::size_t{0}, spheres.size(),
                    [&](std::size_t i) { around[i] = bounds.around(i); });
  std::vector<std::vector<float>> kappa;
  kappa.reserve(balls.size() + 1);
  for (const auto& level : balls) kappa.emplace_back(level.size(), 1.0f);
  kappa.push_back({1.0f});
  for (std::size_t i = 0; i < spheres.size(); ++i)
    for (std::size_t k = 0; k < kappa.size(); ++k) {
      float& bound = kappa[k][k < balls.size() ? i >> (4 * (k + 1)) : 0];
      bound = std::max(bound, static_cast<float>(around[i][k]));
    }
  return kappa;
}

}  // namespace ist
