#include <ist/solid.h>
#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "bake/backend/make_backend.h"
#include "bake/bake_solid.h"
#include "base/elementary.h"
#include "base/hashing.h"
#include "base/message_text.h"
#include "base/thread_arena.h"
#include "mesh/level_set/polygonise.h"
#include "packing/backend/solid_backend.h"
#include "packing/base/packing_settings.h"
#include "packing/cover/cover.h"

namespace ist {
namespace {

constexpr std::uint64_t kPairs = 20'000;
constexpr double kRounding = 1e-9;  ///< of the coordinates: no double-precision field is worse

/// A number in [0, 1) for every index: SplitMix64.
double random_at(std::uint64_t index) {
  return static_cast<double>(mixed((index + 1) * 0x9e3779b97f4a7c15u) >> 11) * 0x1p-53;
}

/// Throws Error, with a position, if a signed distance is not finite or if, between two of some
/// thousand points in and around the bounds, it changes by more than their distance.
void require_lipschitz(const Solid& solid) {
  const UnitFrame frame = unit_frame(solid.bounds());
  const Eigen::Vector3d half = solid.bounds().sizes() / 2;
  const double far = frame.centre.cwiseAbs().maxCoeff() + half.maxCoeff();
  struct Finding {
    double steepness = 0;  ///< change over distance
    bool not_finite = false;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
  };
  std::vector<Finding> findings(kPairs);
  tbb::parallel_for(std::uint64_t{0}, kPairs, [&](std::uint64_t i) {
    // Distances from the whole box down to a 4096th of it.
    const double reach = std::ldexp(half.maxCoeff(), -static_cast<int>(i % 13));
    Eigen::Vector3d p, q;
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t at = 6 * i + static_cast<std::uint64_t>(k);
      p[k] = frame.centre[k] + 1.1 * half[k] * (2 * random_at(at) - 1);
      q[k] = p[k] + reach * (2 * random_at(at + 3) - 1);
    }
    const double a = solid.signed_distance(p), b = solid.signed_distance(q);
    const Eigen::Vector3d between = q - p;
    const double apart =
        std::sqrt(between[0] * between[0] + between[1] * between[1] + between[2] * between[2]);
    Finding& found = findings[i];
    found.place = p;
    found.not_finite = !std::isfinite(a) || !std::isfinite(b);
    if (!found.not_finite && std::abs(a - b) > apart + kRounding * far)
      found.steepness = std::abs(a - b) / apart;
  });
  const Finding* worst = &findings[0];
  for (const Finding& one : findings) {
    if (one.not_finite)
      throw Error("solid: its signed distance is not finite near " + position_text(one.place));
    if (one.steepness > worst->steepness) worst = &one;
  }
  if (worst->steepness > 0)
    throw Error("solid: its signed distance is not 1-Lipschitz: its slope is " +
                shortest(worst->steepness) + " near " + position_text(worst->place) +
                ". Divide it by its largest slope");
}

/// The solid by its signed distance, in the frame of the mesh and with the mesh's volume, so that
/// all stages use one frame and one volume.
class FramedSolid final : public Solid {
 public:
  FramedSolid(const Solid& solid, const MeshSolid& mesh) : solid_(solid), mesh_(mesh) {}

  double signed_distance(const Eigen::Vector3d& x) const override {
    return solid_.signed_distance(x);
  }
  Eigen::AlignedBox3d bounds() const override { return mesh_.bounds(); }
  double volume() const override { return mesh_.volume(); }

 private:
  const Solid& solid_;
  const MeshSolid& mesh_;
};

/// The backend, on the host, for a solid with a signed distance and a mesh that approximates it:
/// packed and covered by the signed distance, calibrated by the mesh. Both are in the mesh's unit
/// frame. `error` [u]: the distance between the two surfaces is at most this; protrusions include
/// it. Solid and mesh must outlive the backend.
class PolygonisedBackend final : public SolidBackend {
 public:
  PolygonisedBackend(const Solid& solid, const MeshSolid& mesh, double error)
      : solid_(solid, mesh),
        frame_(mesh.frame()),
        error_(error / frame_.scale()),
        of_mesh_(make_host_backend(mesh)) {}

  SpherePacking pack(const PackingSettings& settings, const ProgressCallback& progress) override {
    return pack_on_host(solid_, settings, progress);
  }

  std::vector<MedialNode> medial_nodes(const MedialSettings& settings) override {
    return of_mesh_->medial_nodes(settings);
  }

  RelaxedSites relax_sites(const RelaxTask& task,
                           const std::function<void(double)>& report) override {
    return of_mesh_->relax_sites(task, report);
  }

  double largest_protrusion(std::span<const Sphere> balls) override {
    return of_mesh_->largest_protrusion(balls) + error_;
  }

  std::vector<double> cover_radii(const CoverTask& task,
                                  const std::function<void(int)>& report) override {
    CoverTask whole = task;
    whole.half += error_;  // the solid may extend beyond the mesh's box
    return cover_on_host(solid_, frame_, whole, report);
  }

  std::unique_ptr<SolidBackend> with(const MeshSolid& other) const override {
    return of_mesh_->with(other);
  }

 private:
  const FramedSolid solid_;
  const UnitFrame frame_;
  const double error_;  ///< unit frame
  const std::unique_ptr<SolidBackend> of_mesh_;
};

// Edge of a cell over the mean sphere radius: the error is then some 5 % of that radius.
constexpr double kCellOverRadius = 0.4;
constexpr unsigned kFewestByDefault = 32, kMostByDefault = 256;

/// The number of cells along the longest side that suits so many spheres.
unsigned cells_for(const Solid& solid, std::size_t spheres) {
  const double count = spheres == 0 ? 1e4 : static_cast<double>(spheres);
  const double radius = cube_root(3 * solid.volume() / (4 * std::numbers::pi * count));
  const double cells = solid.bounds().sizes().maxCoeff() / (kCellOverRadius * radius);
  if (!(cells < kMostByDefault)) return kMostByDefault;
  return std::max(kFewestByDefault, static_cast<unsigned>(std::ceil(cells)));
}

Asset bake_field(const Solid& solid, const PackingSettings& settings,
                 const PolygoniseSettings& meshing, const ProgressCallback& progress) {
  if (settings.grid != GridMode::banded)
    throw Error(meshing.name +
                ": only the banded mode packs solids that are not meshes; set grid to banded");
  require_lipschitz(solid);
  const unsigned cells =
      meshing.cells != 0 ? meshing.cells : cells_for(solid, settings.max_spheres);
  Polygonised made = polygonise(solid, cells, progress);
  const ClosedMesh mesh = close_mesh(std::move(made.mesh), meshing.name);
  const MeshSolid mesh_solid(mesh);
  PolygonisedBackend backend(solid, mesh_solid, made.error);
  Resolution as_made;  // the mesh approximates the unchanged solid
  if (mesh.report.meets_itself) as_made.how = Resolution::How::unresolved;
  SharedMesh kept(mesh_solid, as_made, settings.keep_mesh, settings.threads);
  AssetArrays arrays = bake_arrays(mesh, mesh_solid, kept, backend, settings, progress);
  const double scale = mesh_solid.frame().scale();
  if (arrays.mesh != nullptr) {
    MeshArrays of_solid = *arrays.mesh;
    of_solid.header.error = made.error / scale;
    arrays.mesh = std::make_shared<const MeshArrays>(std::move(of_solid));
    arrays.header.mesh_state = static_cast<std::uint32_t>(MeshState::polygonised);
  }
  const double off = std::abs(mesh_solid.volume() - solid.volume()) + solid.volume_error();
  arrays.header.flags |= kFlagPolygonised;
  MeshMoments moments =
      moments_near(mesh_solid.arrays(), mesh_solid.unit_moments(), made.error / scale);
  moments.volume_error += off / scale / scale / scale;
  describe_mass(moments, arrays.header);
  describe_bounds(mesh_solid, made.error / scale, arrays.header);
  arrays.header.polygonise_error = made.error / scale;
  arrays.header.polygonise_cells = cells;
  return Asset(asset_bytes(arrays), meshing.name);
}

}  // namespace

Asset bake(const Solid& solid, const PackingSettings& settings, const ProgressCallback& progress,
           const PolygoniseSettings& meshing) {
  packing::check_settings(settings);
  return thread_arena(settings.threads).execute([&] {
    if (solid.mesh() == nullptr) return bake_field(solid, settings, meshing, progress);
    ClosedMesh described;  // the solid has its geometry, which make_solid() has resolved
    described.name = meshing.name;
    return bake_solid(described, *solid.mesh(), Resolution(), settings, progress);
  });
}

}  // namespace ist
