#include "query/exact_penetration.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include <ist/asset_layout.h>

#include "query/base/no_answer.h"
#include "query/descent/workspace.h"
#include "query/exact/exact_overlap.h"

namespace ist {
namespace {

MeshTree mesh_of(const PlacedTree& placed) {
  const AssetHeader& asset = placed.tree.header();
  return {asset, *at<MeshHeader>(asset, asset.mesh)};
}

/// No coordinate of the mesh is larger, unit frame.
double extent_of(const MeshTree& mesh) {
  const BoxBlock& root = mesh.level[mesh.top].boxes[0];
  const std::uint32_t used = mesh.level[mesh.top - 1].count;
  double extent = 0;
  for (int k = 0; k < 3; ++k)
    for (std::uint32_t l = 0; l < used; ++l)
      extent = std::max(
          {extent, std::abs(double{root.low[k][l]}), std::abs(double{root.high[k][l]})});
  return extent;
}

double offset_of(const PlacedTree& placed) {
  const double* c = placed.tree.header().centre;
  return placed.scale * Eigen::Vector3d(c[0], c[1], c[2]).norm();
}

/// How far a vertex of B may be from where the poses put it against A, and of either from where the
/// mesh has it: A's unit frame. A rotation is off by up to 37 roundings, what moves by it, and the
/// shift between the frames, by 45 at most with all that follows.
double moved_by_rounding(const PlacedTree& a, const MeshTree& mesh_a, const PlacedTree& b,
                         const MeshTree& mesh_b, const RelativePose& pose) {
  constexpr double kHalfUnit = 0x1p-53;
  const double scale = pose.a_from_b.scale;
  const Eigen::Vector3d shift(pose.a_from_b.t[0], pose.a_from_b.t[1], pose.a_from_b.t[2]);
  const double between = std::hypot(b.pose.t[0] - a.pose.t[0], b.pose.t[1] - a.pose.t[1],
                                    b.pose.t[2] - a.pose.t[2]);
  const double rounded =
      45 * (1.8 * scale * extent_of(mesh_b) +
            (between + offset_of(a) + offset_of(b)) / pose.unit_a) +
      5 * shift.norm();
  return 1.1 * kHalfUnit * rounded + (mesh_a.header->error + mesh_a.header->rounding) +
         scale * (mesh_b.header->error + mesh_b.header->rounding);
}

Eigen::Vector3d vector(const exact::Point& p) { return {p.x, p.y, p.z}; }

/// The true volume lies between nothing and the smaller solid's.
void bound_by_solids(const PlacedTree& a, const PlacedTree& b, Penetration& answer) {
  const auto most = [](const PlacedTree& placed) {
    const AssetHeader& asset = placed.tree.header();
    return std::ldexp(asset.volume + asset.volume_error, 3 * asset.exponent) *
           (placed.scale * placed.scale * placed.scale);
  };
  answer.volume_min = 0;
  answer.volume_max = std::min(most(a), most(b)) * (1 + 1e-12);
}

}  // namespace

Penetration exact_penetration(const PlacedTree& a, const PlacedTree& b,
                              const PenetrationSettings& settings, const RelativePose& pose,
                              Workspace& workspace) noexcept {
  if (a.tree.header().mesh == 0 || b.tree.header().mesh == 0) return not_held<Penetration>();
  const MeshTree mesh_a = mesh_of(a), mesh_b = mesh_of(b);
  ExactQuery query(mesh_a, mesh_b, pose.a_from_b, pose.b_from_a,
                   moved_by_rounding(a, mesh_a, b, mesh_b, pose), workspace.impl()->exact);
  const ExactOverlap found = query.run(settings.max_visits);
  if (!found.complete) {
    Penetration answer = not_held<Penetration>();
    if (a.tree.sphere_count() > 0 && b.tree.sphere_count() > 0) {
      PenetrationSettings by_spheres = settings;
      by_spheres.measure = Measure::matched;
      answer = penetration(a, b, by_spheres, workspace);
    }
    bound_by_solids(a, b, answer);
    answer.status = QueryStatus::budget_exhausted;
    return answer;
  }
  const double u = pose.unit_a;
  Penetration answer;
  answer.volume = std::max(0.0, found.volume) * (u * u * u);
  const double error = (found.error + std::max(0.0, -found.volume)) * (u * u * u);
  answer.volume_min = std::max(0.0, answer.volume - error);
  answer.volume_max = answer.volume + error;
  answer.translation_gradient = pose.rotation_a * vector(found.force) * (u * u);
  if (found.volume > 0)
    answer.centroid = pose.to_world(vector(found.origin) + vector(found.moment) / found.volume);
  // The sums' origin from B's.
  const Eigen::Vector3d shift(pose.a_from_b.t[0], pose.a_from_b.t[1], pose.a_from_b.t[2]);
  const Eigen::Vector3d arm =
      pose.rotation_a * ((vector(found.origin) - shift) * u) + pose.unit_offset_b;
  answer.rotation_gradient = pose.rotation_a * vector(found.torque) * (u * u * u) +
                             arm.cross(answer.translation_gradient);
  answer.node_visits = found.visits;
  answer.sphere_pairs = found.crossings;
  return answer;
}

}  // namespace ist
