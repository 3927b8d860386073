#include "query/descent/shares.h"

#include <algorithm>

namespace ist {
namespace {

// From this part of all shares on the weights go to 1.
constexpr double kMany = 0.75;

}  // namespace

ShareWeights share_weights(double room, std::size_t done) noexcept {
  constexpr auto kAll = static_cast<double>(kShares);
  // Weights fall to nothing over the whole of the room, and over less and less of it near the end.
  const double width =
      std::min(room, 1 + (kAll - room) * (kMany * kAll - 1) / ((1 - kMany) * kAll));
  ShareWeights weights{};
  double sum = 0;
  for (std::size_t i = 0; i < done; ++i) {
    weights[i] = std::clamp((room - static_cast<double>(i)) / width, 0.0, 1.0);
    sum += weights[i];
  }
  for (double& weight : weights) weight *= kAll / sum;
  return weights;
}

ShareBounds sort_by_shares(const PairList& list, bool of_b, PairList& sorted) noexcept {
  const std::uint32_t* const nodes = (of_b ? list.b : list.a).get();
  ShareBounds bounds{};
  for (std::size_t i = 0; i < list.size; ++i) ++bounds[share_of(nodes[i]) + 1];
  for (std::size_t s = 0; s < kShares; ++s) bounds[s + 1] += bounds[s];
  ShareBounds to = bounds;
  for (std::size_t i = 0; i < list.size; ++i) {
    const std::size_t at = to[share_of(nodes[i])]++;
    sorted.a[at] = list.a[i];
    sorted.b[at] = list.b[i];
  }
  sorted.size = list.size;
  return bounds;
}

}  // namespace ist
