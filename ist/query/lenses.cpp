#include <ist/lenses.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include <ist/asset_layout.h>
#include "query/asset/sphere_tree.h"
#include "query/base/no_answer.h"
#include "query/base/relative_pose.h"

namespace ist {
namespace {

using Eigen::Vector3d;

/// The tree of a measure and a level of detail; empty if there is none.
std::optional<SphereTree> tree_of(const AssetView& view, Measure measure,
                                  std::uint32_t detail) noexcept {
  const AssetHeader& asset = view.header();
  if (measure == Measure::exact) return std::nullopt;
  if (measure == Measure::inner) {
    if (detail != 0) return std::nullopt;
    return SphereTree(asset, asset.inner_tree);
  }
  if (detail > asset.detail_count) return std::nullopt;
  return SphereTree(asset, matched_tree(asset, detail));
}

/// A node or a sphere of a tree, A's unit frame.
struct Place {
  int level;
  std::uint32_t index;
  Vector3d centre;
  double r;
};

/// Descends both trees together, by recursion, and opens the larger node first.
struct LensSearch {
  const SphereTree tree_a, tree_b;
  const RelativePose& pose;
  const std::uint32_t *const index_a, *const index_b;
  const std::span<OverlapLens> lenses;
  OverlapLenses result = {};

  OverlapLenses find() {
    visit(place_a(tree_a.top, 0), place_b(tree_b.top, 0));
    return result;
  }

  Place place_a(int level, std::uint32_t index) const {
    const NodeBall ball = tree_a.ball(level, index);
    return {level, index, vector(ball.centre), ball.r};
  }
  Place place_b(int level, std::uint32_t index) const {
    const NodeBall ball = tree_b.ball(level, index);
    return {level, index, mapped(pose.a_from_b, ball.centre), ball.r * pose.a_from_b.scale};
  }

  void visit(const Place& a, const Place& b) {
    const double reach = a.r + b.r;
    if (!(reach > 0 && (b.centre - a.centre).squaredNorm() < reach * reach)) return;
    if (a.level == kSphereLevel && b.level == kSphereLevel) return add_lens(a, b);
    const bool open_a = a.level != kSphereLevel && (b.level == kSphereLevel || a.r >= b.r);
    const Place& opened = open_a ? a : b;
    const SphereTree& tree = open_a ? tree_a : tree_b;
    const std::uint32_t first = opened.index * kWidth;
    const std::uint32_t end = std::min(first + kWidth, tree.count(opened.level - 1));
    for (std::uint32_t i = first; i < end; ++i) {
      if (open_a)
        visit(place_a(a.level - 1, i), b);
      else
        visit(a, place_b(b.level - 1, i));
    }
  }

  void add_lens(const Place& a, const Place& b) {
    ++result.total;
    if (result.count == lenses.size()) return;
    const Vector3d between = b.centre - a.centre;
    const double d = between.norm();
    // The lens and its rim, along the line from A's centre.
    const double begin = std::max(d - b.r, -a.r), end = std::min(a.r, d + b.r);
    const double rim = d > 0 ? (d * d + (a.r - b.r) * (a.r + b.r)) / (2 * d) : 0;
    OverlapLens& lens = lenses[result.count++];
    // With the rim beyond a centre the lens is as wide as the smaller ball.
    lens.radius = rim > 0 && rim < d ? std::sqrt(std::max(0.0, (a.r - rim) * (a.r + rim)))
                                     : std::min(a.r, b.r);
    lens.radius *= pose.unit_a;
    lens.thickness = (end - begin) * pose.unit_a;
    const Vector3d axis = d > 0 ? Vector3d(between / d) : Vector3d::UnitZ();
    lens.axis = pose.rotation() * axis;
    lens.centre = pose.to_world(a.centre + 0.5 * (begin + end) * axis);
    lens.sphere_a = index_a[a.index];
    lens.sphere_b = index_b[b.index];
  }
};

}  // namespace

OverlapLenses overlap_lenses(const PlacedAsset& a, const PlacedAsset& b,
                             const LensSettings& settings, std::span<OverlapLens> lenses) noexcept {
  if (lack_spheres(a, b)) return {QueryStatus::missing_data, 0, 0};
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose) return {QueryStatus::invalid_input, 0, 0};
  const auto tree_a = tree_of(a.asset, settings.measure, settings.detail_a);
  const auto tree_b = tree_of(b.asset, settings.measure, settings.detail_b);
  if (!tree_a || !tree_b) return {QueryStatus::invalid_input, 0, 0};
  const auto index = [](const PlacedAsset& placed, const SphereTree& tree) {
    return at<std::uint32_t>(placed.asset.header(), tree.header->sphere_index);
  };
  return LensSearch{*tree_a, *tree_b, *pose, index(a, *tree_a), index(b, *tree_b), lenses}.find();
}

}  // namespace ist
