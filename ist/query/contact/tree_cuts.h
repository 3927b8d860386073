#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

#include "query/asset/sphere_tree.h"
#include "query/contact/contact_numbers.h"

namespace ist {

/// Nodes of one level of a tree: first + i for the bits i of `members`.
struct TreeRegion {
  std::uint64_t members = 0;
  std::uint32_t first = 0;
  int level = 0;
};

/// The recursive division of a tree into regions, down to the nodes of one level. It depends on the
/// tree alone, so regions are the same in every query.
class TreeCuts {
 public:
  explicit TreeCuts(const SphereTree& tree) noexcept : tree_(tree), bin_level_(bin_level(tree)) {}

  /// Leaf blocks or, of large trees, the first level of no more than kMostContactBins nodes.
  static int bin_level(const SphereTree& tree) noexcept {
    int level = 0;
    while (tree.level[level].count > kMostContactBins) ++level;
    return level;
  }

  int bin_level() const noexcept { return bin_level_; }

  TreeRegion root() const noexcept { return {1, 0, tree_.top}; }

  static bool has_member(std::uint64_t members, std::uint32_t i) noexcept {
    return i < kMembers && (members >> i & 1) != 0;
  }

  /// Descends to the first level with more than one member; false if there is none.
  bool open(TreeRegion& region) const noexcept {
    const auto go_down = [&](std::uint32_t node, std::uint32_t nodes) {
      --region.level;
      region.first = kWidth * node;
      const std::uint32_t children =
          std::min(kWidth * nodes, tree_.level[region.level].count - region.first);
      region.members = ones(children);
      return children;
    };
    while (std::has_single_bit(region.members)) {
      if (region.level <= bin_level_) return false;
      const std::uint32_t children =
          go_down(region.first + static_cast<std::uint32_t>(std::countr_zero(region.members)), 1);
      if (children < kFewChildren && region.level > bin_level_) go_down(region.first, children);
    }
    return true;
  }

  /// The members of an open region on one side of its best cut.
  std::uint64_t cut(const TreeRegion& region) const noexcept {
    struct Member {
      Eigen::Vector3d centre;
      double weight;
      std::uint64_t bit;
    };
    Member members[kMembers];
    std::uint32_t count = 0;
    double weight = 0;
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    for (std::uint64_t left = region.members; left != 0; left &= left - 1) {
      const NodeBall ball = tree_.ball(
          region.level, region.first + static_cast<std::uint32_t>(std::countr_zero(left)));
      const double cube = ball.r * ball.r * ball.r;
      members[count++] = {{ball.centre[0], ball.centre[1], ball.centre[2]}, cube, left & -left};
      weight += cube;
      moment += cube * members[count - 1].centre;
    }

    // The cut is perpendicular to the line through two distant members,
    const auto farthest_from = [&](const Eigen::Vector3d& x) {
      std::uint32_t farthest = 0;
      double most = -1;
      for (std::uint32_t i = 0; i < count; ++i) {
        const double square = (members[i].centre - x).squaredNorm();
        if (!(square > most)) continue;
        most = square;
        farthest = i;
      }
      return members[farthest].centre;
    };
    const Eigen::Vector3d one_end = farthest_from(moment / weight);
    const Eigen::Vector3d axis = farthest_from(one_end) - one_end;
    struct Place {
      double along;
      std::uint32_t member;
    };
    Place places[kMembers];
    for (std::uint32_t i = 0; i < count; ++i) places[i] = {axis.dot(members[i].centre), i};
    std::sort(places, places + count, [](const Place& l, const Place& r) {
      return l.along != r.along ? l.along < r.along : l.member < r.member;
    });

    // at the position with the least sum of squares about both sides' means: −|Σ w x|²/Σ w and a
    // constant.
    double best = -std::numeric_limits<double>::infinity();
    std::uint64_t best_side = 0, side = 0;
    double near = 0;
    Eigen::Vector3d near_moment = Eigen::Vector3d::Zero();
    for (std::uint32_t i = 0; i + 1 < count; ++i) {
      const Member& member = members[places[i].member];
      side |= member.bit;
      near += member.weight;
      near_moment += member.weight * member.centre;
      const double gain =
          near_moment.squaredNorm() / near + (moment - near_moment).squaredNorm() / (weight - near);
      if (!(gain > best)) continue;
      best = gain;
      best_side = side;
    }
    return best_side != 0 ? best_side : region.members & -region.members;
  }

  /// The first leaf block and their number: unique, as any two regions are nested or disjoint.
  std::uint64_t id(const TreeRegion& region) const noexcept {
    std::uint64_t first = ~std::uint64_t{0}, size = 0;
    for (std::uint64_t left = region.members; left != 0; left &= left - 1) {
      const std::uint64_t node = region.first + static_cast<std::uint32_t>(std::countr_zero(left));
      const std::uint64_t begin = node << (4 * region.level);
      const std::uint64_t end = (node + 1) << (4 * region.level);
      first = std::min(first, begin);
      size += std::min<std::uint64_t>(end, tree_.level[0].count) - begin;
    }
    return first << 32 | size;
  }

 private:
  // For better cuts, nodes with fewer children than this are divided among their grandchildren.
  static constexpr std::uint32_t kFewChildren = 5;
  static constexpr std::uint32_t kMembers = 64;

  static std::uint64_t ones(std::uint32_t count) noexcept {
    return count < 64 ? (std::uint64_t{1} << count) - 1 : ~std::uint64_t{0};
  }

  const SphereTree& tree_;
  const int bin_level_;
};

}  // namespace ist
