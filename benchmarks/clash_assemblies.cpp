// All clashes of assemblies, beside Manifold's booleans on the same pairs. One thread, its CPU
// time.

#include <ist/bake.h>
#include <ist/pose_eigen.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "clash/clash.h"
#include "manifold_mesh.h"
#include "report.h"
#include "support/mated_rows.h"
#include "support/random_mates.h"
#include "support/turns.h"
#include "timing.h"

namespace {

using Eigen::Vector3d;
using ist::benchmark::ManifoldMesh;
using ist::benchmark::Report;
using ist::benchmark::thread_seconds;

struct Shape {
  explicit Shape(const std::string& name)
      : closed(ist::close_mesh(ist::load_mesh(ist::testing::mated_mesh_path(name)), name)),
        asset(ist::bake_mesh_only(closed)),
        manifold(closed.mesh) {}
  ist::ClosedMesh closed;
  ist::Asset asset;
  ManifoldMesh manifold;
};

struct Scene {
  std::vector<ist::ClashPart> parts;
  std::vector<const Shape*> shapes;

  void add(const Shape& shape, const ist::Pose& pose) {
    parts.push_back({std::to_string(parts.size()), {shape.asset.view(), pose, 1}, ist::kFloat64});
    shapes.push_back(&shape);
  }
};

void measure(Report& report, const std::string& name, const Scene& scene) {
  double start = thread_seconds();
  const std::vector<ist::Clash> found = ist::find_clashes(scene.parts, {0, -1, 1});
  const double own = thread_seconds() - start;
  std::size_t kinds[3] = {}, unanswered = 0;
  for (const ist::Clash& clash : found) {
    ++kinds[static_cast<int>(clash.kind)];
    unanswered += clash.status != ist::QueryStatus::ok ? 1 : 0;
  }
  // Of so many pairs, a part is enough for Manifold.
  const std::size_t asked = std::min<std::size_t>(found.size(), report.quick() ? 20 : 400);
  double others = 0, worst = 0;
  for (std::size_t i = 0; i < asked; ++i) {
    const ist::Clash& clash = found[i * found.size() / asked];
    const Shape &a = *scene.shapes[clash.a], &b = *scene.shapes[clash.b];
    const ist::Pose pose =
        ist::to_pose(ist::to_isometry(scene.parts[clash.a].solid.pose).inverse() *
                     ist::to_isometry(scene.parts[clash.b].solid.pose));
    start = thread_seconds();
    const double volume = a.manifold.overlap(b.manifold, pose);
    others += thread_seconds() - start;
    worst = std::max(worst, std::abs(volume - clash.volume) /
                                std::min(a.asset.view().volume(), b.asset.view().volume()));
  }
  const double each = 1e6 * own / static_cast<double>(found.size());
  const double manifold = 1e6 * others / static_cast<double>(asked);
  report.row("Assemblies", {{"assembly", name},
                            {"parts", scene.parts.size()},
                            {"overlapping", kinds[0]},
                            {"touching", kinds[1]},
                            {"s", own},
                            {"us a listed pair", each},
                            {"Manifold us a pair", manifold},
                            {"ratio", manifold / each},
                            {"apart from Manifold, parts of the smaller", worst}});
  report.target(name + ": Manifold's time by ours, a listed pair", manifold / each, 20);
  report.target(name + ": pairs without an answer", static_cast<double>(unanswered), 0, true);
}

}  // namespace

int main(int argc, char** argv) {
  Report report("clash_assemblies", argc, argv);
  report.page("Clashes of assemblies");
  report.remark(
      "One thread, its CPU time: all of find_clashes(), boxes, volumes, depths and areas; "
      "beside it Manifold's boolean of up to 400 of the pairs that it lists.");
  report.remark(
      "Wall: bricks flush with all their neighbours. Heap: twelve parts of a CAD kernel in "
      "a cube, half of them in right-angled turns.");
  const Shape brick("brick");
  const int edge = report.quick() ? 3 : 10;
  Scene wall;
  for (int i = 0; i < edge * edge * edge; ++i)
    wall.add(brick, {{1, 0, 0, 0},
                     {32.0 * (i % edge), 16.0 * (i / edge % edge), 9.6 * (i / edge / edge)}});
  measure(report, "wall", wall);

  std::vector<std::unique_ptr<Shape>> shapes;
  for (const char* const name : {"bracket", "brick", "fillet_box", "hexbolt", "hub", "keyed_shaft",
                                 "pin", "plate", "rail", "slider", "tube_inner", "tube_outer"})
    shapes.push_back(std::make_unique<Shape>(name));
  const int count = report.quick() ? 100 : 1000;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> any(0, 22 * std::cbrt(count));
  const auto turns = ist::testing::right_angled_turns();
  Scene heap;
  for (int i = 0; i < count; ++i) {
    Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
    place.linear() = (i % 2 == 0 ? turns[static_cast<std::size_t>(i / 2) % turns.size()]
                                 : ist::testing::random_turn(random))
                         .toRotationMatrix();
    place.translation() = Vector3d(any(random), any(random), any(random));
    heap.add(*shapes[static_cast<std::size_t>(i) % shapes.size()], ist::to_pose(place));
  }
  measure(report, "heap", heap);
  return report.write();
}
