#include <ctime>
#include <map>
#include <set>
#include <string>

#include <ist/cover_spheres.h>
#include <ist/types.h>

#include "report.h"
#include "robot_sphere_rivals.h"
#include "robots/description/link_mesh.h"
#include "support/shared_data.h"
#include "timing.h"

// Few spheres that hold a robot's link, beside simpler ways to as many, all proven by the same
// proof.

namespace {

using namespace ist;
using namespace ist::benchmark;

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// [unit frame] largest protrusion of balls that are made to hold the solid.
double largest_of(const MeshSolid& solid, const ClosedMesh& mesh, Balls balls) {
  grow_to_cover(solid, balls, 1e-5);
  for (CoverSphere& ball : balls) {
    ball.centre = solid.frame().from_unit(ball.centre);
    ball.radius *= solid.frame().scale();
  }
  return sphere_protrusion(mesh, balls).largest;
}

struct Total {
  double worst_ratio = 0, seconds = 0;
  std::vector<double> ratios;
};

void measure(Report& report, const std::string& robot, const std::string& urdf, std::size_t count,
             Total& total) {
  const std::string path = testing::shared_path(urdf).string();
  const RobotModel model = read_robot(path);
  const PackagePaths paths(
      path, {{"example-robot-data", testing::shared_path("meshes/dev").string()}}, "");
  std::set<std::string> seen;
  for (const RobotLink& link : model.links) {
    if (link.collision.empty()) continue;
    const auto* const file = std::get_if<LinkMesh>(&link.collision[0].shape);
    if (file == nullptr || !seen.insert(file->file).second) continue;
    const LinkGeometry geometry = geometry_of(link.collision, paths, path);
    ClosedMesh mesh;
    try {
      mesh = close_mesh(geometry.mesh, link.name, OpenMeshPolicy::repair);
    } catch (const Error& error) {
      report.remark(link.name + " is left out: " + error.what());
      continue;
    }
    const MeshSolid solid(mesh);
    const SampledSolid sampled = sample_solid(solid, 8000);
    SphereCoverSettings settings;
    settings.count = count;
    const double begun = ist::benchmark::wall_seconds(), start = cpu_seconds();
    const SphereCover ours = cover_with_spheres(mesh, settings);
    const double cpu = cpu_seconds() - start, seconds = ist::benchmark::wall_seconds() - begun;
    const std::map<std::string, double> rivals = {
        {"greedy medial", largest_of(solid, mesh, greedy_medial(solid, sampled, count))},
        {"packing, cover radii", largest_of(solid, mesh, packing_with_covers(solid, count))},
        {"octree", largest_of(solid, mesh, octree(sampled.targets, count))},
        {"ball a part", largest_of(solid, mesh, box_parts(sampled.targets, count))}};
    double best = 1e300;
    for (const auto& [name, largest] : rivals) best = std::min(best, largest);
    const double ratio = ours.protrusion.largest / best;
    Report::Json row = {{"robot", robot},
                        {"link", link.name},
                        {"proven", prove_cover(mesh, ours.spheres).covered},
                        {"ours, largest [mm]", 1e3 * ours.protrusion.largest},
                        {"mean [mm]", 1e3 * ours.protrusion.mean},
                        {"p95 [mm]", 1e3 * ours.protrusion.p95},
                        {"volume ratio", ours.protrusion.volume_ratio}};
    for (const auto& [name, largest] : rivals) row[name + " [mm]"] = 1e3 * largest;
    row["ours over the best rival"] = ratio;
    row["CPU [s]"] = cpu;
    row["wall [s]"] = seconds;
    report.row(std::to_string(count) + " spheres a link", row);
    total.ratios.push_back(ratio);
    total.worst_ratio = std::max(total.worst_ratio, ratio);
    total.seconds += seconds;
  }
}

}  // namespace

int main(int argc, char** argv) {
  Report report("robot_spheres", argc, argv);
  report.remark(
      "Largest protrusion, proven, of spheres that are proven to hold the link. Every "
      "rival's spheres are made just so much larger that the same proof succeeds.");
  report.remark(
      "Greedy medial: largest balls around 3,000 medial points that protrude by no more "
      "than a level, the most useful first, at the lowest level for which the count is "
      "enough; it is what our search starts from. Octree and ball a part: smallest balls "
      "of what lies in a cell or part.");
  report.remark("Open meshes (Solo12's legs and feet) are repaired first.");
  const std::vector<std::size_t> counts =
      report.quick() ? std::vector<std::size_t>{64} : std::vector<std::size_t>{16, 64, 256};
  for (const std::size_t count : counts) {
    Total ur5, solo;
    measure(report, "UR5", "meshes/dev/robots/ur_description/urdf/ur5_robot.urdf", count, ur5);
    measure(report, "Solo12", "meshes/dev/robots/solo_description/robots/solo12.urdf", count, solo);
    if (count != 64) continue;
    for (auto* total : {&ur5, &solo}) std::sort(total->ratios.begin(), total->ratios.end());
    const auto median = [](const Total& t) { return t.ratios[t.ratios.size() / 2]; };
    report.target("UR5, 64 spheres: ours over the best rival, median link", median(ur5), 0.667,
                  true);
    report.target("UR5, 64 spheres: the worst link", ur5.worst_ratio, 0.667, true);
    report.target("Solo12, 64 spheres: median link", median(solo), 0.667, true);
    report.target("Solo12, 64 spheres: the worst link", solo.worst_ratio, 0.667, true);
    report.target("UR5, 64 spheres: seconds of all links, one after another", ur5.seconds, 2, true);
  }
  return report.write();
}
