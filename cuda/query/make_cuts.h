#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <ist/asset_layout.h>

#include "cuda/query/cuts_ref.h"
#include "query/asset/sphere_tree.h"
#include "query/contact/tree_cuts.h"

// Host code only.

namespace ist::gpu {

/// All regions of a tree, and the ranks of its bins.
class TreeRegions {
 public:
  TreeRegions(const AssetHeader& asset, const TreeHeader& header)
      : tree_(asset, header), cuts_(tree_), ranks_(tree_.level[cuts_.bin_level()].count) {
    nodes_.reserve(2 * ranks_.size() - 1);
    add(cuts_.root());
  }

  const std::vector<CutNode>& nodes() const { return nodes_; }
  const std::vector<std::uint16_t>& ranks() const { return ranks_; }
  std::uint32_t bins() const { return static_cast<std::uint32_t>(ranks_.size()); }
  int shift() const { return 4 * (1 + cuts_.bin_level()); }

 private:
  void add(TreeRegion region) {
    const std::size_t at = nodes_.size();
    nodes_.push_back({cuts_.id(region), ranked_, ranked_ + 1, 0});
    if (!cuts_.open(region)) {
      const int bit = std::countr_zero(region.members);
      ranks_[region.first + static_cast<std::uint32_t>(bit)] =
          static_cast<std::uint16_t>(ranked_++);
      return;
    }
    const std::uint64_t side = cuts_.cut(region);
    add({side, region.first, region.level});
    nodes_[at].rest = static_cast<std::uint32_t>(nodes_.size());
    add({region.members & ~side, region.first, region.level});
    nodes_[at].end = ranked_;
  }

  const SphereTree tree_;
  const TreeCuts cuts_;
  std::vector<CutNode> nodes_;
  std::vector<std::uint16_t> ranks_;
  std::uint32_t ranked_ = 0;
};

}  // namespace ist::gpu
