#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include <ist/cover_spheres.h>

#include "mesh/mesh_solid.h"
#include "spheres/sampled_solid.h"

namespace ist {

/// Looks for few balls that hold a solid and protrude little; unit frame. What it finds is proven
/// to hold the solid before it is handed out.
class [[gnu::visibility("hidden")]] CoverSearch {
 public:
  /// `look`: called now and then, from any thread, with the share [0, 1] that is done at least;
  /// what it throws ends the search.
  CoverSearch(const MeshSolid& solid, std::uint64_t seed, std::function<void(double)> look)
      : solid_(solid), seed_(seed), look_(std::move(look)) {}

  /// `count` balls, or fewer where fewer do as well.
  std::vector<CoverSphere> with_count(std::size_t count) const;

  /// How many balls a plain greedy choice takes to protrude by no more than `level`.
  std::size_t greedy_count(double level) const;

 private:
  const MeshSolid& solid_;
  const std::uint64_t seed_;
  const std::function<void(double)> look_;
};

}  // namespace ist
