#include "packing/grids/host_rounds.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

#include "numerics/team.h"
#include "packing/grids/grid_certificate.h"
#include "packing/grids/host_selection.h"

namespace ist::packing {
namespace {

template <class Work>
void for_each_index(std::size_t from, std::size_t to, const Work& work) {
  oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(from, to, 8),
                            [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
                              for (std::size_t i = range.begin(); i != range.end(); ++i) work(i);
                            });
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
  for_each_index(0, cells_.size(), [&](std::size_t i) {
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
    for_each_index(from, std::min(kept, from + kChunk), [&](std::size_t i) {
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
  for_each_index(0, winners.size(), [&](std::size_t i) {
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

GridUse HostRounds::use() const {
  GridUse u;
  u.cells = grid_.cells();
  u.active_cells = grid_.active_cells();
  u.prototypes = cells_.size();
  u.bytes = grid_.bytes() + cells_.size() * kPrototypeBytes;
  u.dense_bytes = dense_grid_bytes(grid_.cells(), prototypes_.count(), grid_.list_bytes());
  u.hashed = grid_.hashed();
  return u;
}

}  // namespace ist::packing
