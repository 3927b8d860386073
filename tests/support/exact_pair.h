#pragma once

#include <cmath>
#include <utility>

#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <ist/query.h>

#include "query/base/relative_pose.h"
#include "query/descent/workspace.h"
#include "query/exact/exact_overlap.h"

// Exact queries as tests ask them.

namespace ist::testing {

inline Asset surface(TriangleMesh mesh, const char* name = "mesh") {
  return bake_surface(close_mesh(std::move(mesh), name), {}, 1);
}

inline Penetration exactly(const PlacedTree& a, const PlacedTree& b, Workspace& workspace) {
  PenetrationSettings settings;
  settings.measure = Measure::exact;
  return penetration(a, b, settings, workspace);
}

/// What a query knows of its own answer.
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
inline double size_of(const PlacedTree& placed) {
  return 2 * placed.scale * placed.tree.header().ball_radius;
}

inline ExactCheck check_exactly(const PlacedTree& a, const PlacedTree& b, Workspace& workspace) {
  const std::optional<RelativePose> pose = relative_pose(a, b);
  const auto mesh = [](const PlacedTree& placed) {
    const AssetHeader& asset = placed.tree.header();
    return MeshTree(asset, *at<MeshHeader>(asset, asset.mesh));
  };
  const MeshTree mesh_a = mesh(a), mesh_b = mesh(b);
  ExactQuery query(mesh_a, 0, mesh_b, 0, pose->a_from_b, pose->b_from_a, workspace.impl()->exact);
  const ExactOverlap found = query.run(0, 0, true);
  const double sizes = size_of(a) / pose->unit_a * (size_of(b) / pose->unit_a);
  const double gap = std::hypot(found.gap.x, found.gap.y, found.gap.z) / sizes;
  const double unit = pose->unit_a * pose->unit_a * pose->unit_a;
  return {found.complete,    found.consistent, found.crossings, gap, found.sums.volume() * unit,
          found.error * unit};
}

}  // namespace ist::testing
