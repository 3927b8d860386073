#include "packing/grids/grid_schedule.h"

#include <ist/types.h>
#include <algorithm>
#include <cmath>

namespace ist::packing {
namespace {

/// Words and records of a grid under construction, with a third of its cells active.
constexpr double kBytesPerCell = 24;

double cell_count(const GridLayout& g) { return double(g.n[0]) * double(g.n[1]) * double(g.n[2]); }

/// Cells on the longest side such that a compact solid fills some kFirstPrototypes of them: the
/// paper's 4–9, by how much of its box the solid fills.
int automatic_start(const GridFigures& solid) {
  constexpr double kFirstPrototypes = 64;
  double longest = 0;
  for (int k = 0; k < 3; ++k) longest = std::max(longest, solid.upper[k] - solid.lower[k]);
  const double wanted = longest / std::cbrt(std::max(solid.volume, 1e-30) / kFirstPrototypes);
  return static_cast<int>(std::clamp(std::ceil(wanted - 0.01), 4.0, 9.0));
}

/// The finest level ≤ `wanted` whose grid fits the memory.
int affordable(const GridLayout& first, int wanted, std::size_t memory) {
  const double most = static_cast<double>(memory) / kBytesPerCell;
  while (wanted > 0 && cell_count(first) * std::pow(8.0, wanted) > most) --wanted;
  return wanted;
}

void require_size(int start, int levels) {
  if ((std::int64_t{start} << levels) <= kMostGridCells) return;
  throw Error("packing: a grid of " + std::to_string(start) + " cells on the longest side, split " +
              std::to_string(levels) + " times, has more than " + std::to_string(kMostGridCells) +
              " on a side: set a smaller grid start, resolution or fewer refinements");
}

/// Refinements that bring `start` to at least `resolution`.
int levels_to(int start, int resolution) {
  int level = 0;
  while ((std::int64_t{start} << level) < resolution) ++level;
  return level;
}

}  // namespace

int distance_resolution(const GridFigures& solid) {
  constexpr double kCellsPerRoot = 0.12;  // measured on an H200, 8 k to 870 k triangles
  return static_cast<int>(kCellsPerRoot * std::sqrt(static_cast<double>(solid.triangles)));
}

GridSchedule grid_schedule(GridMode mode, const GridSettings& settings, const GridFigures& solid) {
  constexpr int kRefinements = 5, kFinest = 5, kUniform = 4, kHybridRefinements = 4;
  GridSchedule s;
  const int start = settings.start > 0 ? static_cast<int>(settings.start) : automatic_start(solid);
  const int resolution = static_cast<int>(settings.resolution);
  s.rounds_per_level =
      settings.rounds_per_level > 0 ? static_cast<int>(settings.rounds_per_level) : 2;
  if (mode == GridMode::uniform) {
    const int cells = resolution > 0 ? resolution : start << kUniform;
    require_size(cells, 0);
    s.first = make_grid_layout(solid.lower, solid.upper, cells, 0);
    return s;
  }
  const int refinements = settings.refinements >= 0 ? settings.refinements : kRefinements;
  const int asked = resolution > 0 ? levels_to(start, resolution) : -1;
  require_size(start, std::max(refinements, asked));
  int levels = 0;  // that there can be
  while ((start << (levels + 1)) <= kMostGridCells) ++levels;
  s.first = make_grid_layout(solid.lower, solid.upper, start, levels);
  s.finest_prototypes = refinements;
  const int fine = levels_to(start, distance_resolution(solid));
  switch (mode) {
    case GridMode::explicit_refinement:
      s.finest_distances = refinements;
      break;
    case GridMode::implicit_refinement:
      s.distances = asked >= 0 ? asked
                               : affordable(s.first, std::min({std::max(fine, 2), levels, kFinest}),
                                            solid.memory);
      s.finest_distances = s.distances;
      break;
    default:
      s.distances = asked >= 0 ? asked
                               : affordable(s.first, std::min({std::max(fine, 1), levels, kFinest}),
                                            solid.memory);
      s.finest_distances = std::max(
          s.distances, affordable(s.first, std::min(refinements, s.distances + kHybridRefinements),
                                  solid.memory));
      break;
  }
  return s;
}

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
