#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "query/descent/workspace.h"

namespace ist {

/// Parts that the pairs of leaves of a descent are divided into, each a fair sample of the whole.
///
/// A share holds every pair of a sixteenth of one tree's leaf blocks, the same at every pose: its
/// sum is a smooth function of the pose with its own exact gradient. Blocks go to shares by the
/// golden ratio, so that neighbours in the tree, which lie near each other, go to different ones.
inline constexpr std::size_t kShares = 16;

inline std::uint32_t share_of(std::uint32_t block) noexcept {
  return (block * 2654435769u) >> 28;  // 2³² times the golden ratio
}

/// Where each share begins in a list that is sorted by shares, and where the last one ends.
using ShareBounds = std::array<std::size_t, kShares + 1>;

/// What the sum of each share counts if some stand for all.
using ShareWeights = std::array<double, kShares>;

/// Weights of the first `done` shares where limits do for `room` of them, room ≤ done + 1: the
/// later a share the less, so that the sum changes little with the room, which is never quite the
/// same. Towards room for all of them the weights go to 1.
ShareWeights share_weights(double room, std::size_t done) noexcept;

/// Sorts the list by the shares of B's nodes, or of A's; those of one share stay in order.
ShareBounds sort_by_shares(const PairList& list, bool of_b, PairList& sorted) noexcept;

}  // namespace ist
