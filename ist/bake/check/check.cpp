#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <ist/solid.h>
#include <algorithm>
#include <cmath>
#include <random>

#include "bake/check/check_spheres.h"
#include "bake/check/checked_mesh.h"
#include "base/thread_arena.h"
#include "mesh/level_set/polygonise.h"
#include "mesh/mesh_moments.h"
#include "mesh/mesh_solid.h"
#include "mesh/resolve/resolve.h"

namespace ist {
namespace {

using Eigen::Vector3d;

Vector3d of_array(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

Eigen::Matrix3d inertia(const AssetHeader& asset) {
  const double* m = asset.inertia;
  Eigen::Matrix3d result;
  result << m[0], m[3], m[4], m[3], m[1], m[5], m[4], m[5], m[2];
  return result;
}

/// Moments of the inside, from fixed random points of the bounding box. Insensitive to small
/// errors, but based on the set itself, where the winding number is ≥ 1.
class SampledMoments {
 public:
  explicit SampledMoments(const CheckedSolid& solid) : box_(solid.bounds().sizes().prod()) {
    constexpr std::size_t kPoints = 50'000;
    std::mt19937_64 bits(1);
    points_.resize(kPoints);
    for (Vector3d& p : points_)
      for (int k = 0; k < 3; ++k)
        p[k] = solid.bounds().min()[k] +
               solid.bounds().sizes()[k] * (static_cast<double>(bits() >> 11) * 0x1p-53);
    inside_.resize(kPoints);
    tbb::parallel_for(std::size_t{0}, kPoints,
                      [&](std::size_t i) { inside_[i] = solid.winding(points_[i]) >= 1; });
  }

  /// The error of ∫ f over the solid beyond six standard deviations and `error`, as a share of its
  /// maximum: no |f| in the bounding box is larger than `most`. If so little of the box is filled
  /// that 18 points are expected in it, the probability of none is 10⁻⁸.
  template <class Function>
  double off(const Function& f, double expected, double error, double most) const {
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (inside_[i] == 0) continue;
      const double value = f(points_[i]);
      sum += value;
      squares += value * value;
    }
    const double n = static_cast<double>(points_.size());
    const double mean = sum / n;
    const double deviation = std::sqrt(std::max(squares / n - mean * mean, 0.0) / n);
    return std::fabs(mean - expected / box_) / most - 6 * deviation / most - 18 / n -
           error / box_ / most;
  }

 private:
  double box_;
  std::vector<Vector3d> points_;
  std::vector<char> inside_;
};

std::vector<Invariant> sampled(const AssetHeader& asset, const CheckedSolid& solid) {
  const SampledMoments points(solid);
  const char* const kAbove =
      " inside and the header's, above six standard deviations and the stated error, of the "
      "largest that the bounding box allows";
  Tally volume, mass;
  volume.add(points.off([](const Vector3d&) { return 1.0; }, asset.volume, asset.volume_error, 1),
             0);
  const Vector3d centre = of_array(asset.centre_of_mass);
  const double reach = (solid.bounds().max() - centre)
                           .cwiseAbs()
                           .cwiseMax((solid.bounds().min() - centre).cwiseAbs())
                           .norm();
  for (int k = 0; k < 3; ++k)
    mass.add(points.off([&](const Vector3d& p) { return p[k] - centre[k]; }, 0,
                        asset.centre_of_mass_error * asset.volume, reach),
             0);
  const Eigen::Matrix3d expected = inertia(asset);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j)
      mass.add(points.off(
                   [&](const Vector3d& p) {
                     const Vector3d y = p - centre;
                     return (i == j ? y.squaredNorm() : 0) - y[i] * y[j];
                   },
                   expected(i, j), asset.inertia_error, reach * reach),
               1);
  return {
      volume.named("sampled volume", std::string("difference of the share of points") + kAbove),
      mass.named("sampled mass",
                 std::string("difference of a first (0) or second (1) moment of points") + kAbove)};
}

Invariant check_frame(const AssetHeader& asset, const UnitFrame& frame) {
  Tally same;
  same.add(std::abs(asset.exponent - frame.exponent), 0);
  for (int k = 0; k < 3; ++k) same.add(std::fabs(asset.centre[k] - frame.centre[k]), 0);
  return same.named("frame", "difference of the header's frame and the mesh's, [u]");
}

/// Volume, centre of mass and inertia equal `moments`, and approximately those of the solid, by
/// points.
std::vector<Invariant> check_mass(const AssetHeader& asset, const MeshMoments& moments,
                                  const CheckedSolid& solid) {
  Tally volume;
  volume.add(std::fabs(asset.volume - moments.volume) / moments.volume - 1e-12, 0);
  volume.add(std::fabs(asset.volume_error - moments.volume_error) / moments.volume - 1e-12, 0);
  Tally centre;
  for (int k = 0; k < 3; ++k)
    centre.add(std::fabs(asset.centre_of_mass[k] - moments.centre[k]) - 1e-12, 0);
  centre.add(std::fabs(asset.centre_of_mass_error - moments.centre_error) - 1e-12, 0);
  Tally turning;
  const double scale = moments.inertia.trace();
  turning.add((inertia(asset) - moments.inertia).cwiseAbs().maxCoeff() / scale - 1e-12, 0);
  turning.add(std::fabs(asset.inertia_error - moments.inertia_error) / scale - 1e-12, 0);
  std::vector<Invariant> out = {
      volume.named("solid volume",
                   "relative difference of the header's volume and the mesh's, above 1e-12"),
      centre.named("centre of mass",
                   "difference of the header's centre of mass and the mesh's, above 1e-12, unit "
                   "frame"),
      turning.named("inertia",
                    "difference of the header's inertia and the mesh's, above 1e-12, of the "
                    "trace")};
  append(out, sampled(asset, solid));
  return out;
}

/// Box and ball contain the surface, and all places where the solid's surface may be.
std::vector<Invariant> check_bounds(const AssetHeader& asset, const CheckedMesh& checked) {
  const double unit = std::ldexp(1.0, asset.exponent);
  const Vector3d origin = of_array(asset.centre);
  const Vector3d lower = (of_array(asset.box_lower) - origin) / unit;
  const Vector3d upper = (of_array(asset.box_upper) - origin) / unit;
  const Vector3d middle = (of_array(asset.ball_centre) - origin) / unit;
  const double beyond = asset.polygonise_error;
  Tally box, tight, ball;
  for (std::size_t t = 0; t < checked.triangles().size(); ++t)
    for (const Vector3d& corner : checked.triangles()[t]) {
      box.add((lower - corner).maxCoeff() + beyond, t);
      box.add((corner - upper).maxCoeff() + beyond, t);
      ball.add((corner - middle).norm() + beyond - asset.ball_radius / unit, t);
    }
  tight.add((checked.bounds().min() - lower).maxCoeff() - beyond - 1e-12, 0);
  tight.add((upper - checked.bounds().max()).maxCoeff() - beyond - 1e-12, 0);
  return {box.named("box holds solid", "protrusion of the surface out of the box, unit frame"),
          tight.named("box is tight", "gap between box and surface, above 1e-12, unit frame"),
          ball.named("ball holds solid", "protrusion of the surface out of the ball, unit frame")};
}

/// A solid with a signed distance, as `check` uses it. Refers to the solid.
class DistanceSolid final : public CheckedSolid {
 public:
  DistanceSolid(const Solid& solid, const UnitFrame& frame)
      : solid_(solid),
        frame_(frame),
        bounds_(frame.to_unit(solid.bounds().min()), frame.to_unit(solid.bounds().max())) {}

  double distance(const Eigen::Vector3d& p, double) const override { return std::abs(value(p)); }

  int winding(const Eigen::Vector3d& p) const override { return value(p) < 0 ? 1 : 0; }

  const Eigen::AlignedBox3d& bounds() const override { return bounds_; }

 private:
  double value(const Eigen::Vector3d& p) const {
    return solid_.signed_distance(frame_.from_unit(p)) / frame_.scale();
  }

  const Solid& solid_;
  UnitFrame frame_;
  Eigen::AlignedBox3d bounds_;
};

/// `mesh`: the baked mesh, or the mesh that approximates the solid. `solid`: certifies spheres and
/// covers; `checked`: calibrates matched spheres; for a mesh's asset they are the same.
std::vector<Invariant> check_all(const AssetHeader& asset, const ClosedMesh& mesh,
                                 const CheckedSolid& solid, const CheckedMesh& checked,
                                 const UnitFrame& frame, const MeshMoments& moments) {
  std::vector<Invariant> all;
  all.push_back(check_frame(asset, frame));
  append(all, check_mass(asset, moments, solid));
  append(all, check_bounds(asset, checked));
  append(all, check_kept_mesh(asset, mesh, frame, checked));
  if (asset.sphere_count == 0) return all;
  append(all, check_spheres(asset, solid));
  all.push_back(check_cover(asset, solid));
  append(all, check_tree(asset, asset.inner_tree, at<Sphere>(asset, asset.inner_spheres),
                         at<float>(asset, asset.cover_radii), "inner tree"));
  for (std::uint32_t i = 0; i <= asset.detail_count; ++i) {
    const std::string name = i == 0 ? "" : "detail " + std::to_string(i) + ": ";
    append(all, check_matched(asset, i, checked, name));
    append(all, check_tree(asset, matched_tree(asset, i), matched_spheres(asset, i), nullptr,
                           name + "matched tree"));
  }
  return all;
}

std::vector<Invariant> check_mesh(const AssetHeader& asset, const ClosedMesh& as_it_came) {
  const ResolvedMesh resolved = resolve(as_it_came);
  const ClosedMesh& mesh = resolved.mesh;
  const MeshSolid solid(resolved);
  if (solid.hash() != asset.mesh_hash || (asset.flags & kFlagPolygonised) != 0)
    throw Error(mesh.name + ": the asset was baked from another mesh; bake again");
  const CheckedMesh checked(mesh, solid.frame());
  return check_all(asset, mesh, checked, checked, solid.frame(), solid.unit_moments());
}

std::vector<Invariant> check_solid(const AssetHeader& asset, const Solid& solid) {
  if ((asset.flags & kFlagPolygonised) == 0)
    throw Error("solid: the asset was baked from a mesh; check it against that mesh");
  const Polygonised made = polygonise(solid, asset.polygonise_cells);
  const ClosedMesh closed = close_mesh(made.mesh, "solid");
  const MeshSolid mesh(closed);
  const double scale = mesh.frame().scale();
  if (mesh.hash() != asset.mesh_hash || made.error / scale != asset.polygonise_error)
    throw Error("solid: the asset was baked from another solid; bake again");
  const double off = std::abs(mesh.volume() - solid.volume()) + solid.volume_error();
  MeshMoments moments = moments_near(mesh.arrays(), mesh.unit_moments(), made.error / scale);
  moments.volume_error += off / scale / scale / scale;
  return check_all(asset, closed, DistanceSolid(solid, mesh.frame()),
                   CheckedMesh(closed, mesh.frame()), mesh.frame(), moments);
}

}  // namespace

std::vector<Invariant> check(const Asset& asset, const ClosedMesh& mesh, unsigned threads) {
  return thread_arena(threads).execute([&] { return check_mesh(asset.view().header(), mesh); });
}

std::vector<Invariant> check(const Asset& asset, const Solid& solid, unsigned threads) {
  if (solid.mesh() != nullptr)
    throw Error("solid: this solid is a mesh; check the asset against its ClosedMesh");
  return thread_arena(threads).execute([&] { return check_solid(asset.view().header(), solid); });
}

}  // namespace ist
