#pragma once

#include <cstdint>

#include "packing/grids/ascent.h"
#include "packing/grids/host_grid.h"

namespace ist::packing {

/// The rounds of a grid packing on the threads of the current arena (ascent.h says which).
class HostRounds {
 public:
  /// Keeps `mesh`.
  explicit HostRounds(const MeshView& mesh) : grid_(mesh) {}

  void build(const GridLayout& layout);
  void place_prototypes(const GridLayout& layout);
  void split_prototypes();
  std::vector<GridCandidate> converged(const AscentSettings& settings, const GoOn& go_on);
  std::vector<GridWinner> round(const AscentSettings& settings, const GoOn& go_on);
  void append(const std::vector<Sphere>& spheres);
  void update();

 private:
  HostGrid grid_;
  std::vector<Sphere> spheres_;
  std::size_t listed_ = 0;  ///< spheres that the grid knows
  GridLayout prototypes_;
  std::vector<std::uint32_t> cells_;  ///< of the prototype grid, active as of the last round
};

}  // namespace ist::packing
