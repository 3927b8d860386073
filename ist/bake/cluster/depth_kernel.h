#pragma once

#include <cstddef>
#include <vector>

#include "bake/cluster/bounding_ball.h"

namespace ist {

/// Balls that may cover a point together.
struct CoveringBalls {
  std::vector<double> x, y, z;
  std::vector<double> reach2;   ///< a little more than the radius, squared
  std::vector<double> radius2;  ///< the radius squared

  std::size_t size() const { return x.size(); }
  void clear();
  void add(const Ball& ball);
};

/// Upper bound on how many of `others`, each of which meets `home`, cover one point of it.
std::size_t deepest(const Ball& home, const CoveringBalls& others);

}  // namespace ist
