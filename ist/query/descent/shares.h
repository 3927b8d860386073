#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "query/asset/sphere_tree.h"
#include "query/descent/workspace.h"

namespace ist {

/// Parts that the pairs of leaves of a descent are divided into, each a sample of the whole, fair
/// over many poses.
///
/// A share holds every pair of a sixteenth of one tree's leaf blocks, the same at every pose: its
/// sum is a smooth function of the pose with an exact gradient. Neighbours in the tree, which lie
/// near each other, go to different shares. Blocks of large spheres are in none: one of them in
/// sixteen says nothing of the others.
inline constexpr std::size_t kShares = 16;

/// Pairs of large blocks are [0, bounds[0]) of a sorted list, those of share i are
/// [bounds[i], bounds[i + 1]).
using ShareBounds = std::array<std::size_t, kShares + 1>;

/// Sorts the list by the shares of B's nodes, or of A's. `tree`, `level`: those of that side. Pairs
/// of one share stay in order.
ShareBounds sort_by_shares(const PairList& list, const SphereTree& tree, int level, bool of_b,
                           PairList& sorted) noexcept;

/// What each share that is summed counts if some stand for all.
using ShareWeights = std::array<double, kShares>;

/// Weights of the first `done` shares where limits do for `room` of them, in [done, done + 1].
///
/// The later a share the less, and the last one begins with nothing: the sum changes continuously,
/// and little, with the room, which is never quite the same. With room for one more than there are
/// all weights are 1.
ShareWeights share_weights(double room, std::size_t done) noexcept;

}  // namespace ist
