#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <map>
#include <random>
#include <string>

#include <ist/cover_spheres.h>
#include <ist/types.h>

#include "report.h"
#include "robots/description/link_mesh.h"

// Spheres that a planner ships for a robot beside as many of ours: what of the links' surface they
// leave uncovered, and how far they protrude.

namespace {

using namespace ist;
using namespace ist::benchmark;
using Eigen::Vector3d;

struct Uncovered {
  std::size_t points = 0, open = 0;
  double farthest = 0;  ///< [m] from a sphere

  double share() const { return static_cast<double>(open) / static_cast<double>(points); }
};

double area_of(const TriangleMesh& mesh, std::size_t t) {
  const auto& [a, b, c] = mesh.triangles[t];
  return 0.5 *
         (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
}

/// By points spread evenly over the surface, `density` of them a square metre.
void add_uncovered(const TriangleMesh& mesh, const std::vector<CoverSphere>& spheres,
                   double density, Uncovered& sum) {
  std::mt19937_64 random(1);
  const auto share = [&] { return 0x1p-53 * static_cast<double>(random() >> 11); };
  double owed = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    for (owed += density * area_of(mesh, t); owed >= 1; --owed) {
      const double u = std::sqrt(share()), v = share();
      const Vector3d x =
          (1 - u) * mesh.vertices[a] + u * (1 - v) * mesh.vertices[b] + u * v * mesh.vertices[c];
      double gap = std::numeric_limits<double>::infinity();
      for (const CoverSphere& s : spheres) gap = std::min(gap, (x - s.centre).norm() - s.radius);
      ++sum.points;
      sum.open += gap > 0 ? 1 : 0;
      sum.farthest = std::max(sum.farthest, gap);
    }
  }
}

std::map<std::string, std::vector<CoverSphere>> read_spheres(const std::string& path) {
  YAML::Node root = YAML::LoadFile(path);
  if (root["robot_cfg"]) root.reset(root["robot_cfg"]["kinematics"]);
  // What the planner adds to all radii.
  const YAML::Node given = root["collision_sphere_buffer"];
  const double buffer = given && given.IsScalar() ? given.as<double>() : 0;
  std::map<std::string, std::vector<CoverSphere>> spheres;
  for (const auto& link : root["collision_spheres"])
    for (const auto& one : link.second) {
      const auto c = one["center"].as<std::vector<double>>();
      // Spheres of links that are there to be changed have a radius below 0.
      if (const double radius = one["radius"].as<double>(); radius > 0)
        spheres[link.first.as<std::string>()].push_back(
            {{c.at(0), c.at(1), c.at(2)}, radius + buffer});
    }
  return spheres;
}

void add_row(Report& report, const std::string& whose, std::size_t count, const Uncovered& open,
             double protrusion) {
  report.row("whole robot", {{"spheres", whose},
                             {"count", count},
                             {"surface uncovered", open.share()},
                             {"farthest uncovered [mm]", 1e3 * open.farthest},
                             {"largest protrusion [mm]", 1e3 * protrusion}});
}

int measure(const std::string& urdf, const std::string& config, Report& report) {
  constexpr double kDensity = 200'000;  // points a square metre
  const RobotModel robot = read_robot(urdf);
  const PackagePaths paths(urdf, {}, "");
  std::map<std::string, std::vector<CoverSphere>> shipped = read_spheres(config);
  std::vector<ClosedMesh> meshes;
  Uncovered theirs, ours;
  double largest = 0, our_largest = 0;
  SphereCoverSettings settings;
  std::size_t count = 0;
  for (const RobotLink& link : robot.links) {
    if (link.collision.empty() || !shipped.contains(link.name)) continue;
    const std::vector<CoverSphere>& spheres = shipped[link.name];
    meshes.push_back(close_mesh(geometry_of(link.collision, paths, urdf).mesh, link.name));
    add_uncovered(meshes.back().mesh, spheres, kDensity, theirs);
    largest = std::max(largest, sphere_protrusion(meshes.back(), spheres).largest);
    count += spheres.size();
  }
  add_row(report, "shipped", count, theirs, largest);
  settings.total = count;
  const std::vector<SphereCover> covers = cover_with_spheres(meshes, settings);
  count = 0;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    if (!prove_cover(meshes[i], covers[i].spheres).covered) throw Error("not covered");
    add_uncovered(meshes[i].mesh, covers[i].spheres, kDensity, ours);
    our_largest = std::max(our_largest, covers[i].protrusion.largest);
    count += covers[i].spheres.size();
  }
  add_row(report, "ist spheres --total", count, ours, our_largest);
  report.remark("Uncovered surface by points spread evenly over the links' collision meshes, " +
                std::to_string(ours.points) + " in all; ist's cover is proven besides.");
  return report.write();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argv[1][0] == '-') {
    std::cerr << "left out; usage: shipped_spheres ROBOT.urdf CUROBO.yml [--out FILE]\n";
    return 0;
  }
  Report report("shipped_spheres", argc - 2, argv + 2);
  return measure(argv[1], argv[2], report);
}
