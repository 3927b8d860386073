#pragma once

#include <ist/types.h>

#include <span>

#include "cuda/packing/banded/banded_control.h"
#include "packing/banded/banded_packer.h"

namespace ist::gpu {

/// Initial sizes of a packing's arrays, which grow when they are too small.
struct BandedSizes {
  std::uint32_t cells, candidates, spheres, cell_blocks, pairs;
  std::uint64_t words;
};

/// The sizes for a maximum number of spheres (0 = no limit). They suffice for most meshes: they
/// exceed the needs of `dino` and `dragon_871k`.
inline BandedSizes banded_sizes(std::uint64_t max_spheres) {
  const std::uint64_t n = max_spheres > 0 ? std::min<std::uint64_t>(max_spheres, 1u << 20) : 10000;
  const auto size = [](std::uint64_t x) { return static_cast<std::uint32_t>(x); };
  return {size(std::min<std::uint64_t>((1u << 16) + 64 * n, 9u << 19)),
          size((1u << 15) + 8 * n),
          size(n),
          size((1u << 11) + n / 2),
          size((1u << 14) + 8 * n),
          (1u << 20) + 300 * n};
}

/// The arrays of one banded packing. Array<T> is a DeviceArray or, for tests, an array of the host;
/// Place is the argument of its constructor.
template <template <class> class Array, class Place>
class BandedBuffers {
 public:
  BandedBuffers(Place& place, const packing::BandSchedule& schedule, const BandedSizes& sizes)
      : place_(place),
        state_(place, 1),
        queue_(place, kQueue),
        blocks_(place, SphereLists::kMostBlocks),
        ranks_(place, 1) {
    BandedState state;
    state.schedule = schedule;
    state.layout = packing::sphere_grid_layout(schedule.grid_spheres, schedule.grid_reach);
    put_state(state);
    queue_.fill_bytes(0xFF);
    blocks_.fill_bytes(0);
    enlarge_cells(sizes.cells, 0);
    enlarge_candidates(sizes.candidates);
    enlarge_spheres(std::max<std::uint32_t>(sizes.spheres, 1), 0);
    enlarge_grid(sizes.words, sizes.cell_blocks, sizes.pairs);
  }

  BandedArrays arrays() const {
    BandedArrays a{};
    a.state = state_.data();
    a.cells = cells_.data();
    a.bounds = bounds_.data();
    a.free_list = free_list_.data();
    a.lists[0] = lists_[0].data();
    a.lists[1] = lists_[1].data();
    a.refreshed = refreshed_.data();
    a.confined = confined_.data();
    a.splitting = splitting_.data();
    a.cell_capacity = static_cast<std::uint32_t>(cells_.size());
    a.queue = queue_.data();
    a.queue_capacity = kQueue;
    a.nodes = nodes_.data();
    a.heads = heads_.data();
    a.won = won_.data();
    a.winners = winners_.data();
    a.ranks = ranks_.data();
    a.candidate_capacity = static_cast<std::uint32_t>(nodes_.size());
    a.spheres = spheres_.data();
    a.kept = kept_.data();
    a.sphere_capacity = static_cast<std::uint32_t>(spheres_.size());
    SphereLists& grid = a.lists_of_spheres;
    grid.blocks = blocks_.data();
    grid.cells = grid_cells_.data();
    grid.words = words_.data();
    grid.pairs = pairs_.data();
    grid.use = &state_.data()->use;
    grid.word_capacity = words_.size();
    grid.block_capacity =
        static_cast<std::uint32_t>(grid_cells_.size() / SphereLists::kCellsPerBlock);
    grid.pair_capacity = static_cast<std::uint32_t>(pairs_.size());
    return a;
  }

  BandedState state() const { return state_.to_host(1)[0]; }

  /// Enlarges the arrays that stopped the launch, so that it can continue. `state` is the present
  /// one.
  void provide(BandedState state) {
    switch (state.need) {
      case Need::nothing:
        break;
      case Need::cells: {
        const std::size_t most = std::size_t{1} << BandedArrays::kCellBits;
        if (cells_.size() == most)
          throw Error(
              "packing: more than 16 million active cells on the GPU: use fewer spheres or a "
              "larger smallest radius");
        enlarge_cells(std::min(most, 2 * cells_.size()), cells_.size());
        break;
      }
      case Need::candidates:
        enlarge_candidates(state.active + state.active / 4);
        break;
      case Need::spheres: {
        const std::size_t wanted = state.schedule.spheres + state.winners;
        enlarge_spheres(wanted + wanted / 2, state.schedule.spheres);
        break;
      }
      case Need::grid: {
        const auto more = [](std::uint64_t used, std::uint64_t size) {
          return used > size ? used + used / 2 : size;
        };
        const std::uint64_t blocks = grid_cells_.size() / SphereLists::kCellsPerBlock;
        enlarge_grid(more(state.use.words, words_.size()), more(state.use.cell_blocks, blocks),
                     more(state.use.pairs, pairs_.size()));
        state.use = {SphereLists::kFirstWord, 0, 0};
        break;
      }
    }
    state.need = Need::nothing;
    put_state(state);
  }

  /// The packing, without its frame.
  SpherePacking result(const BandedState& state) const {
    const std::size_t count = state.schedule.spheres;
    const std::vector<StoredSphere> stored = spheres_.to_host(count);
    SpherePacking packing;
    packing.spheres.reserve(count);
    for (const StoredSphere& s : stored) packing.spheres.push_back(s.sphere());
    finish(packing, state.schedule, kept_.to_host(count));
    return packing;
  }

 private:
  void put_state(const BandedState& state) {
    sent_ = state;
    state_.upload(std::span<const BandedState>(&sent_, 1));
  }

  void enlarge_cells(std::size_t size, std::size_t kept) {
    grow(cells_, size, kept);
    grow(bounds_, size, kept);
    grow(free_list_, size, kept);
    grow(lists_[0], size, kept);
    grow(lists_[1], size, kept);
    grow(refreshed_, size, kept);
    grow(confined_, size, kept);
    grow(splitting_, size, kept);
  }

  void enlarge_candidates(std::size_t size) {
    std::size_t heads = 64;
    while (heads < 2 * size) heads *= 2;
    renew(nodes_, size);
    renew(heads_, heads);
    heads_.fill_bytes(0);
    renew(winners_, size);
    renew(won_, size);
  }

  void enlarge_spheres(std::size_t size, std::size_t kept) {
    grow(spheres_, size, kept);
    grow(kept_, size, kept);
  }

  void enlarge_grid(std::uint64_t words, std::uint64_t blocks, std::uint64_t pairs) {
    if (words > 0x7FFFFFFFu)
      throw Error(
          "packing: the sphere grid is too large for the GPU: use fewer spheres, or bake on the "
          "CPU");
    if (words > words_.size()) renew(words_, words);
    if (pairs > pairs_.size()) renew(pairs_, pairs);
    if (blocks * SphereLists::kCellsPerBlock > grid_cells_.size())
      renew(grid_cells_, blocks * SphereLists::kCellsPerBlock);
    grid_cells_.fill_bytes(0);
  }

  template <class T>
  void grow(Array<T>& array, std::size_t size, std::size_t kept) {
    if (array.size() == 0)
      array = Array<T>(place_, size);
    else
      array.grow(size, kept);
  }

  template <class T>
  void renew(Array<T>& array, std::size_t size) {
    array.release();
    array = Array<T>(place_, size);
  }

  static constexpr std::uint32_t kQueue = 1u << 18;

  Place& place_;
  Array<BandedState> state_;
  Array<std::uint32_t> queue_;
  Array<BandedArrays::Cell> cells_;
  Array<float> bounds_, kept_;
  Array<std::uint32_t> free_list_, lists_[2], refreshed_, confined_, splitting_, heads_, won_,
      words_, blocks_;
  Array<BucketNode> nodes_;
  Array<Winner> winners_;
  Array<RankBuckets> ranks_;
  Array<StoredSphere> spheres_;
  Array<SphereLists::Cell> grid_cells_;
  Array<SphereLists::Pair> pairs_;
  BandedState sent_;
};

}  // namespace ist::gpu
