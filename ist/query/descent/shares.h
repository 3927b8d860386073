#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "query/asset/sphere_tree.h"
#include "query/descent/workspace.h"
#include "query/kernel/overlap.h"

namespace ist {

/// Parts that the pairs of leaves of a descent are divided into, for a sum that ends early.
///
/// A share holds every pair of a sixteenth of one tree's leaf blocks, the same at every pose: its
/// sum is a smooth function of the pose with an exact gradient. Neighbours in the tree, which lie
/// near each other, go to different shares. Blocks of large spheres are in none: they are summed
/// first. What shares hold differs as blocks do: so all are guessed besides
/// (kernel/guess_kernel.h), and what was found where they were summed says how far guesses of the
/// others go.
inline constexpr std::size_t kShares = 16;

/// Pairs of large blocks are [0, bounds[0]) of a sorted list, those of share i are
/// [bounds[i], bounds[i + 1]).
using ShareBounds = std::array<std::size_t, kShares + 1>;

/// Sorts the list by the shares of B's nodes, or of A's. `tree`, `level`: those of that side. Pairs
/// of one share stay in order.
ShareBounds sort_by_shares(const PairList& list, const SphereTree& tree, int level, bool of_b,
                           PairList& sorted) noexcept;

/// How far the sum of each share counts, from 1 down to 0: for the rest of it others stand.
using ShareWeights = std::array<double, kShares>;

/// Weights of the first `done` shares where limits do for `room` of them, in [done, done + 1].
///
/// The later a share the less, and the last one begins with nothing: the sum changes continuously,
/// and little, with the room, which is never quite the same. With room for one more than there are
/// all weights are 1.
ShareWeights share_weights(double room, std::size_t done) noexcept;

/// What pairs would hold if their blocks were filled evenly.
struct ShareGuesses {
  bool made = false;
  LeafSums large, share[kShares];
};

/// What all shares hold less `part`: what they do hold, each by its weight. `large`: the blocks
/// that are in none.
///
/// Guesses of it, if there are any, count by R, what was found over what was guessed there:
/// (R + 2 R²) / (1 + 2 R²) of them. That is R where pairs hold far less than guessed, as in a
/// thread or where surfaces graze, and nearly 1, whatever R, where guesses do well: then they are
/// nearer than a ratio of few blocks. With room for few shares each stands for all alike instead.
/// Forces are gradients of that, in full.
Overlap other_shares(const Overlap& large, const Overlap& part, const ShareWeights& weights,
                     const ShareGuesses& guesses, Precision precision, double room) noexcept;

}  // namespace ist
