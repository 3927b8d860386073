// Solids laid against copies of themselves, where both sets of spheres repeat each other, and face
// to face, where the spheres of both stick out of the surfaces that meet.

#include <algorithm>
#include <cmath>
#include <optional>

#include <ist/bake.h>
#include <ist/query.h>

#include "mesh/mesh_solid.h"
#include "mesh/samples/samples.h"
#include "report.h"
#include "support/oracle_rows.h"
#include "timing.h"

namespace {

using Eigen::Vector3d;
using ist::benchmark::Report;

/// Volumes [u³] of a solid's overlaps with its copies moved by `shifts` along x, by their meshes.
std::vector<double> overlaps_with_moved_copies(const ist::Asset& asset,
                                               const std::vector<double>& shifts) {
  ist::Workspace workspace;
  std::vector<double> volumes;
  for (const double shift : shifts)
    volumes.push_back(ist::penetration({asset.view(), {}},
                                       {asset.view(), {{1, 0, 0, 0}, {shift, 0, 0}}},
                                       {.measure = ist::Measure::exact}, workspace)
                          .volume);
  return volumes;
}

/// A solid with its spheres, turned so that a sample's z axis is x.
struct Baked {
  Baked(const std::string& name, std::size_t spheres) : closed(closed_mesh(name)), solid(closed) {
    asset.emplace(ist::bake(closed, {.max_spheres = spheres}));
  }

  static ist::ClosedMesh closed_mesh(const std::string& name) {
    if (name == "dino")
      return ist::close_mesh(ist::load_mesh(ist::testing::oracle_mesh_path(name)), name);
    ist::TriangleMesh mesh = ist::make_sample(name);
    for (Vector3d& v : mesh.vertices) v = Vector3d(v.z(), v.x(), v.y());
    return ist::close_mesh(std::move(mesh), name);
  }

  ist::ClosedMesh closed;
  ist::MeshSolid solid;
  std::optional<ist::Asset> asset;
};

struct Placement {
  std::string name;
  double shift = 0;  ///< [u] along x
};

/// [µs] of thread time a query, the least of a few repetitions.
template <class Query>
double microseconds(Query query) {
  double least = 1e9;
  for (int i = 0; i < 20; ++i) {
    const double start = ist::benchmark::thread_seconds();
    query();
    least = std::min(least, ist::benchmark::thread_seconds() - start);
  }
  return 1e6 * least;
}

void ask_copies(Report& report, const std::string& name, std::size_t spheres) {
  const Baked baked(name, spheres);
  const double volume = baked.solid.volume();
  const double side = baked.solid.bounds().sizes().x();
  const double radius = std::cbrt(3 * volume / (4 * M_PI * static_cast<double>(spheres)));
  std::vector<Placement> placements = {{"coincident", 0}};
  for (const double radii : {0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2}) {
    char text[32];
    std::snprintf(text, sizeof text, "%g mean radii apart", radii);
    placements.push_back({text, radii * radius});
  }
  placements.push_back({"half a side apart", 0.5 * side});
  std::vector<double> shifts;
  for (const Placement& placement : placements) shifts.push_back(placement.shift);
  const std::vector<double> exact = overlaps_with_moved_copies(*baked.asset, shifts);
  ist::Workspace workspace;
  double worst_alike = 0, worst = 0;
  for (std::size_t k = 0; k < placements.size(); ++k) {
    const ist::PlacedAsset a{baked.asset->view(), {}, 1};
    const ist::PlacedAsset b{baked.asset->view(), {{1, 0, 0, 0}, {shifts[k], 0, 0}}, 1};
    // What penetration() would say without minding copies.
    ist::ContactPatch patch;
    const auto alike = [&] {
      return ist::contact_patches(a, b, {}, workspace, {&patch, 1}).penetration;
    };
    const auto answer = [&] { return ist::penetration(a, b, {}, workspace); };
    const double error_alike = 100 * (alike().volume / exact[k] - 1);
    const double error = 100 * (answer().volume / exact[k] - 1);
    worst_alike = std::max(worst_alike, std::abs(error_alike));
    worst = std::max(worst, std::abs(error));
    report.row("Copies at nearly the same pose",
               {{"solid", name},
                {"spheres", spheres},
                {"placement", placements[k].name},
                {"exact, % of the solid", 100 * exact[k] / volume},
                {"equal spheres: error %", error_alike},
                {"answer: error %", error},
                {"answer: µs", microseconds(answer)}});
  }
  report.target("largest error over that of equal spheres, " + name + ", " +
                    std::to_string(spheres) + " spheres",
                worst / worst_alike, 0.5, true);
}

void ask_faces(Report& report, const std::string& name, std::size_t spheres) {
  const Baked baked(name, spheres);
  const double volume = baked.solid.volume();
  const double side = baked.solid.bounds().sizes().x();
  const double radius = std::cbrt(3 * volume / (4 * M_PI * static_cast<double>(spheres)));
  const std::vector<double> gaps = {-0.8, -0.4, -0.2, -0.1, -0.05, 0, 0.05, 0.1, 0.2, 0.4};
  std::vector<double> shifts;
  for (const double gap : gaps) shifts.push_back(side + gap * radius);
  const std::vector<double> exact = overlaps_with_moved_copies(*baked.asset, shifts);
  ist::Workspace workspace;
  double worst_raw = 0, worst = 0;
  const double face = exact.front() / (0.8 * radius);  // what it takes to be one
  for (std::size_t k = 0; k < gaps.size(); ++k) {
    const ist::PlacedAsset a{baked.asset->view(), {}, 1};
    const ist::PlacedAsset b{baked.asset->view(), {{1, 0, 0, 0}, {shifts[k], 0, 0}}, 1};
    const ist::Penetration raw = ist::penetration(a, b, {}, workspace);
    const ist::Penetration sharp = ist::without_protrusion(raw, a, b);
    const double layer = face * radius;
    if (gaps[k] >= -0.1) {
      worst_raw = std::max(worst_raw, std::abs(raw.volume - exact[k]));
      worst = std::max(worst, std::abs(sharp.volume - exact[k]));
    }
    report.row("Face to face",
               {{"solid", name},
                {"spheres", spheres},
                {"gap / mean radius", gaps[k]},
                {"gap / side", gaps[k] * radius / side},
                {"exact volume", exact[k] / layer},
                {"volume", raw.volume / layer},
                {"without protrusion", sharp.volume / layer},
                {"force", raw.force.norm() / face},
                {"force without protrusion", sharp.force.norm() / face},
                {"µs", microseconds([&] { return ist::penetration(a, b, {}, workspace); })},
                {"µs without protrusion", microseconds([&] {
                   return ist::without_protrusion(ist::penetration(a, b, {}, workspace), a, b);
                 })}});
  }
  report.target("wrong volume about contact over that with protrusion, " + name + ", " +
                    std::to_string(spheres) + " spheres",
                worst / worst_raw, 0.7, true);
}

}  // namespace

int main(int argc, char** argv) {
  Report report("aligned", argc, argv);
  report.remark(
      "Copies are moved along the sample's z axis (dino: x); exact volumes by a million columns.");
  report.remark(
      "Equal spheres: the sum of lenses of the asset's spheres with their own copies, before; the "
      "answer: what penetration() says.");
  report.remark(
      "Face to face: volumes in faces times mean radii of a sphere, forces in faces; the face is "
      "the "
      "area that meets, and exact forces are 1 below gap 0 and 0 above. Without protrusion: "
      "without_protrusion().");
  const std::vector<std::size_t> counts = report.quick()
                                              ? std::vector<std::size_t>{1'000}
                                              : std::vector<std::size_t>{1'000, 4'000, 16'000};
  for (const std::size_t spheres : counts)
    for (const std::string name : {"cube", "bolt", "gear", "dino"}) {
      ask_copies(report, name, spheres);
      if (name != "dino") ask_faces(report, name, spheres);
    }
  return report.write();
}
