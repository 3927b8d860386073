#pragma once

#include <cmath>
#include <utility>

#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <ist/query.h>

#include "query/base/relative_pose.h"
#include "query/exact/exact_overlap.h"
#include "query/scratch/workspace.h"

// Exact queries for tests.

namespace ist::testing {

inline Asset surface(TriangleMesh mesh, const char* name = "mesh") {
  return bake_mesh_only(close_mesh(std::move(mesh), name), 1);
}

inline Penetration exactly(const PlacedAsset& a, const PlacedAsset& b, Workspace& workspace) {
  PenetrationSettings settings;
  settings.measure = Measure::exact;
  return penetration(a, b, settings, workspace);
}

struct ExactCheck {
  bool complete = false;
  bool consistent = false;
  std::uint32_t crossings = 0;
  /// How far the overlap's surface is from closed, in parts of the product of both solids' sizes.
  double gap = 0;
  /// [u³] and how far it may be off by the query's own arithmetic, were poses and meshes exact.
  double volume = 0, error = 0;
};

/// A tenth of a rounding for each crossing pair and a hundred more.
inline double gap_bound(const ExactCheck& check) { return 2e-17 * (100 + check.crossings); }

/// No two points of a placed solid are further apart.
inline double size_of(const PlacedAsset& placed) {
  return 2 * placed.scale * placed.asset.header().ball_radius;
}

/// A query that also reports how far the surface of its overlap is from closed.
class GapQuery : public ExactQuery {
 public:
  using ExactQuery::ExactQuery;

  /// An area vector: rounding, if all is well.
  exact::Point gap() const {
    exact::Point gap = {};
    const auto add = [&](double factor, const exact::Point& p) { gap = gap + factor * p; };
    // The vector from the nearer end of a pierced edge.
    for (std::uint32_t i = 0; i < out_.crossings; ++i)
      for (int e = 0; e < 2; ++e) {
        const CrossingEnd end = scratch_.crossings.end_of(i, e);
        const Side& own = sides_[end.of_b ? 1 : 0];
        const std::uint32_t block = end.triangle / kWidth;
        const std::uint32_t k = end.from_first ? end.edge : (end.edge + 1) % 3;
        add(own.is_b == end.enters ? -0.5 : 0.5,
            cross(scratch_.crossings.place_of(i, e, out_.origin),
                  own.marks.blocks[own.marks.place[block]].at(
                      own.mesh.blocks[block].corner[k][end.triangle % kWidth])));
      }
    for (const Side& own : sides_) {
      for_each_block(own.marks.pierced, own.mesh.level[0].count, [&](std::uint32_t b) {
        const MeshBlock& mesh = own.mesh.blocks[b];
        const CrossedBlock& crossed = own.marks.blocks[own.marks.place[b]];
        for (std::uint32_t t = 0; t < mesh.triangles; ++t)
          for (std::uint32_t k = 0; k < 3; ++k)
            add(middle_of(mesh, crossed, 3 * t + k) * (own.is_b ? -0.5 : 0.5),
                cross(crossed.at(mesh.corner[k][t]), crossed.at(mesh.corner[(k + 1) % 3][t])));
      });
      for_each_inside(own, own.mesh.top, 0, [&](int level, std::uint32_t i, std::uint32_t lane) {
        add(own.is_b ? -1 : 1, lane_sums(own, level, i, lane, out_.origin).normal);
      });
    }
    return gap;
  }
};

inline ExactCheck check_exactly(const PlacedAsset& a, const PlacedAsset& b, Workspace& workspace) {
  const std::optional<RelativePose> pose = relative_pose(a, b);
  const auto mesh = [](const PlacedAsset& placed) {
    const AssetHeader& asset = placed.asset.header();
    return MeshTree(asset, *at<MeshHeader>(asset, asset.mesh));
  };
  const MeshTree mesh_a = mesh(a), mesh_b = mesh(b);
  GapQuery query(mesh_a, 0, mesh_b, 0, pose->a_from_b, pose->b_from_a, workspace.impl()->exact);
  const ExactOverlap found = query.run();
  const exact::Point open = found.complete ? query.gap() : exact::Point{};
  const double sizes = size_of(a) / pose->unit_a * (size_of(b) / pose->unit_a);
  const double gap = std::hypot(open.x, open.y, open.z) / sizes;
  const double unit = pose->unit_a * pose->unit_a * pose->unit_a;
  return {found.complete,    found.consistent, found.crossings, gap, found.sums.volume() * unit,
          found.error * unit};
}

}  // namespace ist::testing
