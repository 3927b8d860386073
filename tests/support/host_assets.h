#pragma once

#include <vector>

#include <ist/query.h>

#include "cuda/query/batch_arrays.h"

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

}  // namespace ist::testing
