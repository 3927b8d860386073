#include "query/descent/shares.h"

#include <algorithm>

namespace ist {
namespace {

// Blocks of more than this times the mean volume are in no share. Most of a solid is in few blocks:
// of a deep contact of 4,000 spheres a sample without them misses half.
constexpr double kLarge = 8;

// From this part of all shares on the weights go to 1.
constexpr double kMany = 0.75;

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
  double sum = 0;
  for (std::size_t i = 0; i < done; ++i) {
    weights[i] = std::clamp((end - static_cast<double>(i)) / width, 0.0, 1.0);
    sum += weights[i];
  }
  for (double& weight : weights) weight *= kAll / sum;
  return weights;
}

}  // namespace ist
