#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <ist/asset_layout.h>
#include <ist/gpu_query.h>
#include <ist/shapes.h>
#include <ist/types.h>

#include "cuda/query/solid_ref.h"
#include "query/asset/sphere_tree.h"
#include "query/base/pair_place.h"
#include "query/contact/tree_cuts.h"
#include "query/shape/shapes.h"

// Solids of a batch in plain numbers. Host code only.

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

/// The heights or distances that a field points to; none if they are out of range.
inline std::span<const std::byte> pointed_to(const Shape& field) {
  const auto bytes = [](const auto* from, std::size_t count) {
    return std::as_bytes(std::span(from, count));
  };
  if (const auto* const f = std::get_if<HeightFieldShape>(&field); f != nullptr && is_sound(*f))
    return bytes(f->heights, std::size_t{f->columns} * f->rows);
  if (const auto* const g = std::get_if<DistanceGridShape>(&field); g != nullptr && is_sound(*g))
    return bytes(g->distances, std::size_t{g->size[0]} * g->size[1] * g->size[2]);
  return {};
}

/// `at`: the address of the field's data where the batch runs. The kind is `unusable` if a number
/// is out of range.
inline FieldRef field_ref(const Shape& field, const std::byte* at) {
  FieldRef ref = {};
  ref.kind = FieldKind::unusable;
  if (!std::visit([](const auto& f) { return is_sound(f); }, field)) return ref;
  const auto* const floats = reinterpret_cast<const float*>(at);
  if (const auto* const f = std::get_if<HalfSpaceShape>(&field)) {
    ref.kind = FieldKind::half_space;
    ref.half_space = plain(*f);
  } else if (const auto* const f = std::get_if<BoxShape>(&field)) {
    ref.kind = FieldKind::box;
    ref.box = plain(*f);
  } else if (const auto* const f = std::get_if<BallShape>(&field)) {
    ref.kind = FieldKind::ball;
    ref.ball = plain(*f);
  } else if (const auto* const f = std::get_if<CapsuleShape>(&field)) {
    ref.kind = FieldKind::capsule;
    ref.capsule = plain(*f);
  } else if (const auto* const f = std::get_if<CylinderShape>(&field)) {
    ref.kind = FieldKind::cylinder;
    ref.cylinder = plain(*f);
  } else if (const auto* const f = std::get_if<HeightFieldShape>(&field)) {
    if (std::all_of(f->heights, f->heights + std::size_t{f->columns} * f->rows,
                    [](float height) { return std::isfinite(height); }))
      ref.kind = FieldKind::height;
    ref.height = plain(*f);
    ref.height.heights = floats;
  } else if (const auto* const f = std::get_if<DistanceGridShape>(&field)) {
    ref.kind = FieldKind::grid;
    ref.grid = plain(*f);
    ref.grid.distances = floats;
  }
  return ref;
}

/// The sums of all nodes, level by level.
inline std::vector<NodeSum> node_sums(const SphereTree& tree) {
  std::vector<NodeSum> sums;
  std::size_t below = 0;
  for (int level = 0; level <= tree.top; ++level) {
    const std::uint32_t children = level == 0 ? kWidth * tree.count(0) : tree.count(level - 1);
    const std::size_t first = sums.size();
    for (std::uint32_t c = 0; c < children; ++c) {
      if (c % kWidth == 0) sums.push_back({});
      NodeSum& sum = sums.back();
      if (level > 0) {
        const NodeSum child = sums[below + c];
        sum.cubes += child.cubes;
        for (int k = 0; k < 3; ++k) sum.moment[k] += child.moment[k];
        continue;
      }
      const NodeBall ball = tree.sphere(c / kWidth, c % kWidth);
      if (!(ball.r > 0)) continue;
      const double cube = ball.r * ball.r * ball.r;
      sum.cubes += cube;
      for (int k = 0; k < 3; ++k) sum.moment[k] += cube * ball.centre[k];
    }
    below = first;
  }
  return sums;
}

/// The nodes of the lowest level of a tree that has no more than kMostFilled.
inline std::vector<FilledBall> filled_balls(const SphereTree& tree) {
  int level = 0;
  while (level < tree.top && tree.count(level) > kMostFilled) ++level;
  std::vector<FilledBall> balls;
  for (std::uint32_t i = 0; i < tree.count(level); ++i) {
    const NodeBall ball = tree.ball(level, i);
    const double sphere = ball_volume(ball.r);
    balls.push_back({{ball.centre[0], ball.centre[1], ball.centre[2]},
                     ball.r,
                     tree.sums(level, i).volume / sphere});
  }
  return balls;
}

/// The radius of a ball about `centre` that contains all balls.
inline double reach_of(const std::vector<FilledBall>& balls, const double* centre) {
  double reach = 0;
  for (const FilledBall& ball : balls)
    reach = std::max(
        reach,
        std::hypot(ball.x[0] - centre[0], ball.x[1] - centre[1], ball.x[2] - centre[2]) + ball.r);
  return reach * (1 + 1e-9);
}

/// The index of the first solid that is the same asset (are_one_asset(), query/lod/level_blend.h).
inline std::uint32_t first_alike(std::span<const GpuSolid> solids, const AssetHeader& of) {
  for (std::uint32_t k = 0;; ++k) {
    const auto* const tree = std::get_if<AssetView>(&solids[k]);
    if (tree != nullptr && tree->header().content_hash == of.content_hash &&
        tree->header().file_bytes == of.file_bytes)
      return k;
  }
}

/// Makes solid i of a batch. `put` copies an array to memory of the batch and returns its address.
///
/// Throws Error for a solid that batches do not support.
template <class Put>
SolidRef solid_ref(std::span<const GpuSolid> solids, std::size_t i, const Put& put) {
  const auto refuse = [i](const char* why) {
    throw Error("GPU: solid " + std::to_string(i) + " is " + why);
  };
  SolidRef ref = {};
  if (const auto* const field = std::get_if<Shape>(&solids[i])) {
    if (std::holds_alternative<FunctionShape>(*field))
      refuse(
          "a FunctionShape, which a GPU cannot call: sample it into a DistanceGridShape, or bake "
          "its solid");
    ref.frame = {{0, 0, 0}, 1};
    ref.field = field_ref(*field, put(pointed_to(*field)));
    return ref;
  }
  const AssetView& asset = std::get<AssetView>(solids[i]);
  if (asset.empty()) refuse("an empty asset");
  if (asset.sphere_count() == 0 && !asset.has_mesh())
    refuse("an asset without spheres and without a mesh: bake it with either");
  const AssetHeader& header = asset.header();
  const auto* const here = reinterpret_cast<const std::byte*>(&header);
  const std::byte* const bytes = put(std::span(here, header.file_bytes));
  ref.frame = frame_of(header);
  if (header.mesh != 0) {
    const MeshTree mesh(header, *at<MeshHeader>(header, header.mesh));
    ref.mesh = mesh.copied_to(bytes, header);
    ref.in_floats = put(float_blocks(mesh));
    ref.box = MeshBox::of(header);
  }
  ref.volume = std::ldexp(header.volume + header.volume_error, 3 * header.exponent);
  ref.radius = header.ball_radius;
  if (asset.sphere_count() == 0) return ref;
  for (const Measure measure : {Measure::matched, Measure::inner}) {
    const TreeHeader& tree = measure == Measure::inner ? header.inner_tree : header.matched_tree;
    const auto k = static_cast<int>(measure);
    ref.tree[k] = TreeRef::of(tree, bytes);
    ref.sums[k] = SumsRef::of(tree, put(node_sums({header, tree})));
    const TreeRegions regions(header, tree);
    ref.cuts[k] = {put(regions.nodes()), put(regions.ranks()), regions.bins(), regions.shift()};
  }
  ref.cover = CoverRef::of(header.inner_tree, bytes);
  std::vector<DetailRef> levels;
  std::vector<FilledBall> roots;
  for (std::uint32_t i = 0; i <= header.detail_count; ++i) {
    const TreeHeader& tree = matched_tree(header, i);
    levels.push_back({TreeRef::of(tree, bytes), LevelCost::of(tree)});
    roots.push_back({{tree.root[0], tree.root[1], tree.root[2]}, tree.root[3], 1});
  }
  const std::vector<FilledBall> filled =
      filled_balls({header, matched_tree(header, header.detail_count)});
  ref.details.coarser = header.detail_count;
  ref.details.mean_radius = header.matched_tree.mean_radius;
  ref.details.reach = reach_of(roots, roots.front().x);
  ref.details.filled_reach = reach_of(filled, roots.back().x);
  ref.details.filled_count = static_cast<std::uint32_t>(filled.size());
  ref.details.filled = put(filled);
  ref.details.level = put(levels);
  ref.details.first_alike = first_alike(solids, header);
  return ref;
}

}  // namespace ist::gpu
