#pragma once

#include <deque>
#include <vector>

#include <ist/query.h>

#include "cuda/query/asset_parts.h"
#include "cuda/query/batch_arrays.h"

namespace ist::testing {

/// Assets as a batch of the GPU's finds them, in the host's memory.
class HostAssets {
 public:
  HostAssets(const std::vector<TreeView>& assets) {
    for (const TreeView& asset : assets) {
      const AssetHeader& header = asset.header();
      const auto* const bytes = reinterpret_cast<const std::byte*>(&header);
      parts_.push_back(gpu::AssetParts::of(header, bytes));
      const gpu::AssetParts& parts = parts_.back();
      refs_.push_back(parts.ref(header, bytes,
                                {parts.sums.data(), parts.levels.data(), parts.filled.data(),
                                 parts.cuts.data(), parts.ranks.data()},
                                gpu::first_alike(assets, refs_.size())));
      most_bins_ = std::max(most_bins_, parts.most_bins());
    }
  }

  const std::vector<gpu::AssetRef>& refs() const { return refs_; }
  std::uint32_t most_bins() const { return most_bins_; }

 private:
  std::vector<gpu::AssetRef> refs_;
  std::deque<gpu::AssetParts> parts_;
  std::uint32_t most_bins_ = 0;
};

}  // namespace ist::testing
