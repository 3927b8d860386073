#pragma once

#include <vector>

#include <ist/query.h>

#include "cuda/query/batch_arrays.h"
#include "support/fiber_team.h"

namespace ist::testing {

/// Assets as a batch of the GPU's finds them, in the host's memory.
class HostAssets {
 public:
  HostAssets(const std::vector<TreeView>& assets) {
    for (const TreeView& asset : assets) {
      const AssetHeader& header = asset.header();
      const auto* const bytes = reinterpret_cast<const std::byte*>(&header);
      std::vector<gpu::NodeSum>& nodes = nodes_.emplace_back();
      for (const TreeHeader* tree : {&header.matched_tree, &header.inner_tree}) {
        const std::vector<gpu::NodeSum> more = gpu::node_sums(*tree, bytes);
        nodes.insert(nodes.end(), more.begin(), more.end());
      }
      refs_.push_back(gpu::AssetRef::of(header, bytes));
      refs_.back().set_sums(header, nodes.data());
    }
  }

  const std::vector<gpu::AssetRef>& refs() const { return refs_; }

 private:
  std::vector<gpu::AssetRef> refs_;
  std::vector<std::vector<gpu::NodeSum>> nodes_;
};

/// Calls work(team) by a team of one or, where there is a seed for the order of its lanes, by every
/// lane of one of 32.
template <class Work>
void by_team(unsigned seed, const Work& work) {
  if (seed == 0) {
    work(SerialTeam());
    return;
  }
  static Fibers<32> fibers(seed);
  fibers.run([&](int lane) { work(FiberTeam<32>(fibers, lane)); });
}

}  // namespace ist::testing
