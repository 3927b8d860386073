#include "packing/grids/pack_grids.h"

#include <ist/types.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "base/team.h"
#include "base/thread_arena.h"
#include "packing/grids/ascent.h"
#include "packing/grids/distance_grid.h"
#include "packing/grids/host_grid.h"
#include "packing/grids/prototype_cells.h"

namespace ist::packing {
namespace {

/// The candidates for which `keep(index)` is true.
template <class Keep>
std::vector<GridCandidate> filtered(const std::vector<GridCandidate>& candidates,
                                    const Keep& keep) {
  std::vector<std::uint8_t> kept(candidates.size());
  for_each_index(0, candidates.size(), 64, [&](std::size_t i) { kept[i] = keep(i) ? 1 : 0; });
  std::vector<GridCandidate> out;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (kept[i] != 0) out.push_back(candidates[i]);
  return out;
}

/// Candidates by size class and cell: class c contains radii in [2^(c−1), 2^c) · 2^−kClasses, in
/// cells wide enough that a smaller candidate overlaps none beyond the neighbours of its own cell.
class SizeClasses {
 public:
  explicit SizeClasses(const std::vector<GridCandidate>& candidates) : candidates_(candidates) {
    for (std::uint32_t i = 0; i < candidates.size(); ++i) {
      const int c = class_of(candidates[i].radius);
      used_[static_cast<std::size_t>(c)] = true;
      cells_[key(c, candidates[i].centre, 0, 0, 0)].push_back(i);
    }
  }

  bool outdone(std::size_t index) const {
    const GridCandidate& me = candidates_[index];
    for (int c = class_of(me.radius); c < kClasses; ++c) {
      if (!used_[static_cast<std::size_t>(c)]) continue;
      for (int n = 0; n < 27; ++n) {
        const auto cell = cells_.find(key(c, me.centre, n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
        if (cell == cells_.end()) continue;
        for (const std::uint32_t i : cell->second)
          if (goes_before(candidates_[i], me) && overlap(candidates_[i], me)) return true;
      }
    }
    return false;
  }

 private:
  static constexpr int kClasses = 26;
  static int class_of(float radius) {
    int exponent = 0;
    std::frexp(radius, &exponent);  // radius < 2^exponent
    const int c = exponent + kClasses - 2;
    return c < 0 ? 0 : (c >= kClasses ? kClasses - 1 : c);
  }
  static std::uint64_t key(int c, Float3 p, int dx, int dy, int dz) {
    const float width = std::ldexp(2.01f, c - (kClasses - 2));
    const auto along = [&](float x, int d) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor((x + 4) / width)) +
                                        d) &
             0xFFFFF;
    };
    // Classes narrower than the smallest would not fit 20 bits; their keys only get coarser lists.
    return mixed(along(p.x, dx) | along(p.y, dy) << 20 | along(p.z, dz) << 40) +
           static_cast<std::uint64_t>(c);
  }

  const std::vector<GridCandidate>& candidates_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
  std::array<bool, kClasses> used_{};
};

/// The paper's selection on the host's threads: among the candidates that no neighbouring cell's
/// candidate outranks, those that no preceding one overlaps. `candidates`: one a cell of `layout`,
/// in any order.
std::vector<GridCandidate> selected(const GridLayout& layout,
                                    const std::vector<GridCandidate>& candidates) {
  const std::size_t size = hash_size(candidates.size());
  std::vector<std::uint32_t> keys(size, CellTable::kEmpty), values(size);
  for (std::uint32_t i = 0; i < candidates.size(); ++i) {
    std::size_t at = DistanceGrid::hashed(candidates[i].cell) & (size - 1);
    while (keys[at] != CellTable::kEmpty) at = (at + 1) & (size - 1);
    keys[at] = candidates[i].cell;
    values[at] = i;
  }
  const CellTable table{keys.data(), values.data(), static_cast<std::uint32_t>(size - 1)};
  const std::vector<GridCandidate> ahead = filtered(candidates, [&](std::size_t i) {
    return candidates[i].radius > 0 &&
           !outdone_by_neighbour(layout, table, candidates.data(), static_cast<std::uint32_t>(i));
  });
  const SizeClasses classes(ahead);
  return filtered(ahead, [&](std::size_t i) { return !classes.outdone(i); });
}

/// The rounds of a grid packing on the threads of the current arena (see ascent.h).
class HostRounds {
 public:
  /// Keeps a reference to `mesh`.
  explicit HostRounds(const MeshView& mesh) : grid_(mesh) {}

  void build(const GridLayout& layout) {
    grid_.build(layout, spheres_);
    listed_ = spheres_.size();
  }

  void place_prototypes(const GridLayout& layout) {
    prototypes_ = layout;
    cells_.resize(layout.count());
    for (std::uint32_t cell = 0; cell < layout.count(); ++cell) cells_[cell] = cell;
  }

  void split_prototypes() {
    const GridLayout coarse = prototypes_;
    prototypes_ = refined(coarse);
    std::vector<std::uint32_t> children;
    children.reserve(8 * cells_.size());
    for (const std::uint32_t cell : cells_) {
      int i = 0, j = 0, k = 0;
      coarse.coordinates(cell, i, j, k);
      for (int n = 0; n < 8; ++n)
        children.push_back(prototypes_.id(2 * i + (n & 1), 2 * j + (n >> 1 & 1), 2 * k + (n >> 2)));
    }
    cells_.swap(children);
  }

  std::vector<GridCandidate> converged(const AscentSettings& settings, const GoOn& go_on) {
    const GridScene scene = grid_.scene(spheres_);
    std::vector<std::uint8_t> active(cells_.size());
    for_each_index(0, cells_.size(), 8, [&](std::size_t i) {
      active[i] = prototype_cell_active(SerialTeam{}, scene, prototypes_, cells_[i]) ? 1 : 0;
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < cells_.size(); ++i)
      if (active[i] != 0) cells_[kept++] = cells_[i];
    cells_.resize(kept);
    cells_.shrink_to_fit();
    std::vector<GridCandidate> candidates(kept);
    constexpr std::size_t kChunk = 4096;  // prototypes between two checks of clock and progress
    for (std::size_t from = 0; from < kept; from += kChunk) {
      for_each_index(from, std::min(kept, from + kChunk), 8, [&](std::size_t i) {
        candidates[i] = converged_prototype(SerialTeam{}, scene, settings, cells_[i]);
      });
      if (!go_on()) return {};
    }
    return candidates;
  }

  std::vector<GridWinner> round(const AscentSettings& settings, const GoOn& go_on) {
    const std::vector<GridCandidate> winners = selected(prototypes_, converged(settings, go_on));
    const GridScene scene = grid_.scene(spheres_);
    std::vector<GridWinner> certified(winners.size());
    for_each_index(0, winners.size(), 8, [&](std::size_t i) {
      certified[i] = {winners[i], certified_clearance(SerialTeam{}, scene, winners[i])};
    });
    return certified;
  }

  void append(const std::vector<Sphere>& spheres) {
    spheres_.insert(spheres_.end(), spheres.begin(), spheres.end());
  }

  void update() {
    grid_.update(spheres_, listed_);
    listed_ = spheres_.size();
  }

 private:
  HostGrid grid_;
  std::vector<Sphere> spheres_;
  std::size_t listed_ = 0;  ///< spheres that are in the grid
  GridLayout prototypes_;
  std::vector<std::uint32_t> cells_;  ///< active cells of the prototype grid after the last round
};

/// Words and records of a grid under construction, with a third of its cells active.
constexpr double kBytesPerCell = 24;

double cell_count(const GridLayout& g) { return double(g.n[0]) * double(g.n[1]) * double(g.n[2]); }

/// Cells on the longest side such that a compact solid fills some kFirstPrototypes of them: the
/// paper's 4–9, depending on how much of its box the solid fills.
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

GridFigures grid_figures(const MeshSolid& solid, std::size_t memory) {
  GridFigures figures;
  const Eigen::AlignedBox3d bounds = solid.bounds();
  const Eigen::Vector3d lower = solid.frame().to_unit(bounds.min());
  const Eigen::Vector3d upper = solid.frame().to_unit(bounds.max());
  for (int k = 0; k < 3; ++k) {
    figures.lower[k] = lower[k];
    figures.upper[k] = upper[k];
  }
  figures.volume = solid.unit_volume();
  figures.triangles = solid.arrays().triangle_count;
  figures.memory = memory;
  return figures;
}

SpherePacking pack_grids(const MeshSolid& solid, const PackingSettings& settings, Stage& stage) {
  constexpr std::size_t kHostMemory = std::size_t{512} << 20;
  return pack_grids_by(HostRounds(solid.arrays()), solid, settings, kHostMemory, stage);
}

MedialGrids medial_grids(const MeshSolid& mesh, unsigned resolution) {
  constexpr int kRefinements = 3;
  constexpr std::size_t kMemory = std::size_t{512} << 20;
  const GridFigures figures = grid_figures(mesh, kMemory);
  GridSettings grids;
  if (resolution > 0) {
    grids.start = resolution;
    grids.refinements = 0;
    const int wanted = distance_resolution(figures);
    const int most = kMostGridCells / 2;
    grids.resolution = std::max(resolution, static_cast<unsigned>(std::min(wanted, most)));
  }
  const GridSchedule schedule = grid_schedule(GridMode::implicit_refinement, grids, figures);
  return {schedule.level(resolution > 0 ? 0 : kRefinements), schedule.level(schedule.distances)};
}

std::vector<MedialNode> medial_nodes_of(std::vector<GridCandidate> converged,
                                        const UnitFrame& frame) {
  constexpr int kFewestContacts = 2;
  std::erase_if(converged, [](const GridCandidate& c) {
    return !(c.radius > 0) || c.contacts < kFewestContacts;
  });
  std::sort(converged.begin(), converged.end(),
            [](const auto& a, const auto& b) { return a.cell < b.cell; });
  std::vector<MedialNode> nodes;
  nodes.reserve(converged.size());
  for (const GridCandidate& c : converged)
    nodes.push_back({frame.from_unit({c.centre.x, c.centre.y, c.centre.z}),
                     double{c.radius} * frame.scale(), c.contacts});
  return nodes;
}

std::vector<MedialNode> medial_nodes_on_host(const MeshSolid& mesh,
                                             const MedialSettings& settings) {
  return medial_nodes_by(HostRounds(mesh.arrays()), mesh, settings);
}

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
  int levels = 0;  // the maximum
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
  // Edges with 8 significant bits and an origin that is a multiple of their last bit at the finest
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
