#include "packing/grids/grid_layout.h"

#include <algorithm>
#include <cmath>

namespace ist::packing {

GridLayout make_grid_layout(const double lower[3], const double upper[3], int start,
                            int refinements) {
  const double margin = 2 * double{kSearchMargin};
  double longest = 0;
  for (int k = 0; k < 3; ++k) longest = std::max(longest, upper[k] - lower[k] + 4 * margin);
  // Edges of 8 significant bits and an origin that is a multiple of their last bit at the finest
  // level: 24 bits then represent every border exactly.
  int exponent = 0;
  std::frexp(longest / start, &exponent);
  const double unit = std::ldexp(1.0, exponent - 8);
  const double finest = std::ldexp(unit, -refinements);
  const double size = std::ceil(longest / start / unit) * unit;
  GridLayout g;
  g.size = static_cast<float>(size);
  g.inverse_size = static_cast<float>(1 / size);
  float* const origin[3] = {&g.origin.x, &g.origin.y, &g.origin.z};
  for (int k = 0; k < 3; ++k) {
    const double from = std::floor((lower[k] - margin) / finest) * finest;
    *origin[k] = static_cast<float>(from);
    g.n[k] = std::max(1, static_cast<int>(std::ceil((upper[k] + margin - from) / size)));
  }
  return g;
}

}  // namespace ist::packing
