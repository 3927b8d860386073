#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <ist/cover_spheres.h>

#include "mesh/mesh_solid.h"
#include "spheres/cover_descent.h"
#include "spheres/sampled_solid.h"

namespace ist {

/// Looks for few balls that hold a solid and protrude little; unit frame. What it finds is proven
/// to hold the solid before it is handed out.
class CoverSearch {
 public:
  /// `look`: called now and then with the share [0, 1] that is done; what it throws ends the search.
  CoverSearch(const MeshSolid& solid, std::uint64_t seed, std::function<void(double)> look)
      : solid_(solid), seed_(seed), look_(std::move(look)) {}

  /// `count` balls, or fewer where fewer do as well.
  std::vector<CoverSphere> with_count(std::size_t count);

  /// How many balls a plain greedy choice takes to protrude by no more than `level`.
  std::size_t greedy_count(double level);

 private:
  void sample(std::size_t count);
  LevelCover greedy(std::size_t count);
  LevelCover exchanged(LevelCover cover, std::size_t count, double factor);
  LevelCover settled(LevelCover cover);
  double add_missed(const LevelCover& cover);

  const MeshSolid& solid_;
  std::uint64_t seed_;
  const std::function<void(double)> look_;
  SampledSolid sampled_;
};

}  // namespace ist
