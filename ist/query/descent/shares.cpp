#include "query/descent/shares.h"

#include <algorithm>

namespace ist {
namespace {

// Blocks of more than this times the mean volume are in no share. Most of a solid is in few blocks.
constexpr double kLarge = 8;

// From this part of all shares on the weights go to 1.
constexpr double kMany = 0.75;

// Of R² in how much guesses count. Volumes of deep and light contacts of four pairs of solids
// hardly change between 1 and 3; forces in deep ones would have more, in a thread less.
constexpr double kTrust = 2;

// So much of the rest's guess is held against what was found too: where little was tried R stays
// small and changes smoothly.
constexpr double kUntried = 0.01;

// Up to so many shares each stands for all alike, from so many on guesses do for the others, and
// between both are blended.
constexpr double kAlike = 3, kByGuess = 5;

// Guesses that are so small a part of what was found say nothing.
constexpr double kNothing = 1e-9;

/// The golden ratio's multiples: any run of blocks is spread evenly.
std::uint32_t share_of(std::uint32_t block) { return (block * 2654435769u) >> 28; }
static_assert(kShares == 16);

}  // namespace

ShareBounds sort_by_shares(const PairList& list, const SphereTree& tree, int level, bool of_b,
                           PairList& sorted) noexcept {
  const std::uint32_t* const nodes = (of_b ? list.b : list.a).get();
  const double large = kLarge * tree.header->volume_sum / tree.count(level);
  const auto group_of = [&](std::uint32_t node) -> std::uint32_t {
    return tree.sums(level, node).volume > large ? 0 : share_of(node) + 1;
  };
  std::array<std::size_t, kShares + 2> begin{};  // of each group
  for (std::size_t i = 0; i < list.size; ++i) ++begin[group_of(nodes[i]) + 1];
  for (std::size_t g = 0; g <= kShares; ++g) begin[g + 1] += begin[g];
  ShareBounds bounds;
  std::copy(begin.begin() + 1, begin.end(), bounds.begin());
  for (std::size_t i = 0; i < list.size; ++i) {
    const std::size_t at = begin[group_of(nodes[i])]++;
    sorted.a[at] = list.a[i];
    sorted.b[at] = list.b[i];
  }
  sorted.size = list.size;
  return bounds;
}

ShareWeights share_weights(double room, std::size_t done) noexcept {
  constexpr auto kAll = static_cast<double>(kShares);
  // A share that there has come to be room for begins with no weight.
  const double end = std::max(room - 1, 1e-9);
  // Weights fall to nothing over the whole of the room, and over less and less of it near the end.
  const double width = std::min(end, 1 + (kAll - end) * (kMany * kAll - 1) / ((1 - kMany) * kAll));
  ShareWeights weights{};
  for (std::size_t i = 0; i < done; ++i)
    weights[i] = std::clamp((end - static_cast<double>(i)) / width, 0.0, 1.0);
  return weights;
}

Overlap other_shares(const Overlap& large, const Overlap& part, const ShareWeights& weights,
                     const ShareGuesses& guesses, Precision precision, double room) noexcept {
  double weight = 0;
  for (const double one : weights) weight += one;
  Overlap alike = part;
  alike.scale(static_cast<double>(kShares) / weight - 1);
  if (!guesses.made) return alike;

  LeafSums tried_sums = guesses.large, rest_sums;
  for (std::size_t i = 0; i < kShares; ++i) {
    tried_sums.add(guesses.share[i], weights[i]);
    rest_sums.add(guesses.share[i], 1 - weights[i]);
  }
  Overlap found = large;
  found.add(part);
  Overlap rest = finish(rest_sums, precision), expected = rest;
  expected.scale(kUntried);
  expected.add(finish(tried_sums, precision));
  if (!(expected.volume > kNothing * found.volume)) return alike;
  const double ratio = found.volume / expected.volume;
  const double trust = kTrust * ratio * ratio;
  const double counts = (ratio + trust) / (1 + trust);
  // d(counts)/d(ratio)
  const double slope = (1 + 2 * kTrust * ratio * (1 - counts)) / (1 + trust);
  const double pull = rest.volume * slope / expected.volume;
  rest.scale(counts);
  rest.force += pull * (found.force - ratio * expected.force);
  rest.torque += pull * (found.torque - ratio * expected.torque);

  const double guessed = std::clamp((room - kAlike) / (kByGuess - kAlike), 0.0, 1.0);
  rest.scale(guessed);
  alike.scale(1 - guessed);
  rest.add(alike);
  return rest;
}

}  // namespace ist
