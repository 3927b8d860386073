#include "bake/cluster/overlap_bound.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <algorithm>

#include <ist/asset_layout.h>
#include "bake/cluster/depth_kernel.h"

namespace ist {
namespace {

// A point that many spheres cover lies in the smallest of them: it is enough to look, inside every
// sphere, for the point that most larger ones cover.

double squared(double x) { return x * x; }

class OverlapBounds {
 public:
  OverlapBounds(std::span<const Ball> spheres, const std::vector<std::vector<Ball>>& balls)
      : spheres_(spheres), balls_(balls) {}

  /// What one thread needs.
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
      depth[k] = same ? depth[k - 1] : 1 + static_cast<float>(deepest(spheres_[i], others));
    }
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
