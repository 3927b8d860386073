#include "packing/grids/host_rounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "base/team.h"
#include "base/thread_arena.h"
#include "packing/grids/discrete_distance.h"
#include "packing/grids/grid_certificate.h"
#include "packing/grids/prototype_cells.h"

namespace ist::packing {
namespace {

/// Those of `candidates` that `keep(index)` is true for.
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

/// Candidates by size class and place: class c contains radii in [2^(c−1), 2^c) · 2^−kClasses, in
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
    // Classes below the least one's width would not fit 20 bits; their key only gets coarser lists.
    return mixed(along(p.x, dx) | along(p.y, dy) << 20 | along(p.z, dz) << 40) +
           static_cast<std::uint64_t>(c);
  }

  const std::vector<GridCandidate>& candidates_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
  std::array<bool, kClasses> used_{};
};

/// The paper's selection on the host's threads: of the candidates that no neighbouring cell's
/// outdoes, those that no other of them goes before and overlaps. `candidates`: one a cell of
/// `layout`; in no particular order.
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

}  // namespace

void HostRounds::build(const GridLayout& layout) {
  grid_.build(layout, spheres_);
  listed_ = spheres_.size();
}

void HostRounds::place_prototypes(const GridLayout& layout) {
  prototypes_ = layout;
  cells_.resize(layout.count());
  for (std::uint32_t cell = 0; cell < layout.count(); ++cell) cells_[cell] = cell;
}

void HostRounds::split_prototypes() {
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

std::vector<GridCandidate> HostRounds::converged(const AscentSettings& settings,
                                                 const GoOn& go_on) {
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
  constexpr std::size_t kChunk = 4096;  // prototypes between two looks at clock and progress
  for (std::size_t from = 0; from < kept; from += kChunk) {
    for_each_index(from, std::min(kept, from + kChunk), 8, [&](std::size_t i) {
      candidates[i] = converged_prototype(SerialTeam{}, scene, settings, cells_[i]);
    });
    if (!go_on()) return {};
  }
  return candidates;
}

std::vector<GridWinner> HostRounds::round(const AscentSettings& settings, const GoOn& go_on) {
  const std::vector<GridCandidate> winners = selected(prototypes_, converged(settings, go_on));
  const GridScene scene = grid_.scene(spheres_);
  std::vector<GridWinner> certified(winners.size());
  for_each_index(0, winners.size(), 8, [&](std::size_t i) {
    certified[i] = {winners[i], certified_room(SerialTeam{}, scene, winners[i])};
  });
  return certified;
}

void HostRounds::append(const std::vector<Sphere>& spheres) {
  spheres_.insert(spheres_.end(), spheres.begin(), spheres.end());
}

void HostRounds::update() {
  grid_.update(spheres_, listed_);
  listed_ = spheres_.size();
}

}  // namespace ist::packing
