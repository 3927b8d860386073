// Contact patches along the oracle's trajectory: how many keep their identity from step to step,
// how far their centroids move, what they cost beside the plain query, and how well they sum up.

#include <algorithm>
#include <string>
#include <vector>

#include <ist/bake.h>
#include <ist/query.h>

#include "report.h"
#include "support/oracle_rows.h"
#include "timing.h"

namespace {

using Eigen::Vector3d;
using ist::benchmark::quantile;
using ist::benchmark::Report;

ist::Asset bake_oracle_mesh(const std::string& mesh, std::size_t spheres) {
  const std::string path = ist::testing::oracle_mesh_path(mesh);
  ist::PackingSettings settings;
  settings.max_spheres = spheres;
  return ist::bake(ist::close_mesh(ist::load_mesh(path), path), settings);
}

struct Step {
  double volume = 0;  ///< exact
  ist::Pose pose;
};

std::vector<Step> read_trajectory() {
  const std::string folder = ist::testing::shared_path("oracle/poses").string();
  const auto poses = ist::testing::read_csv(folder + "/traj_eledino.csv");
  const auto truths = ist::testing::read_csv(folder + "/truth_traj_eledino.csv");
  std::vector<Step> steps;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto at = [&](const char* column) { return std::stod(poses[i].at(column)); };
    steps.push_back({std::stod(truths.at(i).at("volume")),
                     {{at("qw"), at("qx"), at("qy"), at("qz")}, {at("tx"), at("ty"), at("tz")}}});
  }
  return steps;
}

struct Persistence {
  double patches = 0, kept = 0;      ///< counts, over all steps but the first of a contact
  double force = 0, kept_force = 0;  ///< their |force|
  std::vector<double> motion;        ///< of a kept patch's centroid over that of the contact's
};

/// Follows the patches of consecutive steps with contact in both.
Persistence follow(const ist::PlacedAsset& a, ist::PlacedAsset b, const std::vector<Step>& steps,
                   std::size_t most, ist::Workspace& workspace) {
  Persistence result;
  std::vector<ist::ContactPatch> now(most), last(most);
  std::size_t last_count = 0;
  Vector3d last_shift = Vector3d::Zero();
  for (const Step& step : steps) {
    b.pose = step.pose;
    const ist::ContactPatches found = ist::contact_patches(a, b, {}, workspace, now);
    const Vector3d shift(step.pose.t[0], step.pose.t[1], step.pose.t[2]);
    const double moved = (shift - last_shift).norm();
    for (std::size_t i = 0; last_count > 0 && i < found.count; ++i) {
      result.patches += 1;
      result.force += now[i].area;
      const auto old = std::find_if(last.begin(), last.begin() + static_cast<long>(last_count),
                                    [&](const auto& p) { return p.id == now[i].id; });
      if (old == last.begin() + static_cast<long>(last_count)) continue;
      result.kept += 1;
      result.kept_force += now[i].area;
      if (moved > 0) result.motion.push_back((now[i].centroid - old->centroid).norm() / moved);
    }
    last_shift = shift;
    last_count = found.count;
    std::swap(now, last);
  }
  return result;
}

/// Median over steps, in turn, of the time of contact_patches over that of penetration: the least
/// of some rounds each, one after the other.
double cost(const ist::PlacedAsset& a, ist::PlacedAsset b, const std::vector<Step>& steps,
            std::size_t most, ist::Workspace& workspace) {
  constexpr int kRounds = 5;
  std::vector<ist::ContactPatch> patches(most);
  std::vector<double> plain(steps.size(), 1e9), divided(steps.size(), 1e9), ratios;
  for (int round = 0; round < kRounds; ++round)
    for (std::size_t i = 0; i < steps.size(); ++i) {
      b.pose = steps[i].pose;
      const double start = ist::benchmark::wall_seconds();
      ist::penetration(a, b, {}, workspace);
      const double middle = ist::benchmark::wall_seconds();
      ist::contact_patches(a, b, {}, workspace, patches);
      const double end = ist::benchmark::wall_seconds();
      plain[i] = std::min(plain[i], middle - start);
      divided[i] = std::min(divided[i], end - middle);
    }
  for (std::size_t i = 0; i < steps.size(); ++i)
    if (steps[i].volume > 0) ratios.push_back(divided[i] / plain[i]);
  return quantile(ratios, 0.5);
}

/// Largest difference of the summed wrench and the whole's, relative to the whole's.
double wrench_error(const ist::PlacedAsset& a, ist::PlacedAsset b, const std::vector<Step>& steps,
                    std::size_t most, ist::Workspace& workspace) {
  std::vector<ist::ContactPatch> patches(most);
  double worst = 0;
  for (const Step& step : steps) {
    b.pose = step.pose;
    const ist::Penetration whole = ist::penetration(a, b, {}, workspace);
    const ist::ContactPatches found = ist::contact_patches(a, b, {}, workspace, patches);
    if (found.count == 0) continue;
    Vector3d force = -whole.force, torque = -whole.torque;
    for (std::size_t i = 0; i < found.count; ++i) {
      force += patches[i].force;
      torque += patches[i].torque;
    }
    worst =
        std::max({worst, force.norm() / whole.force.norm(), torque.norm() / whole.torque.norm()});
  }
  return worst;
}

}  // namespace

int main(int argc, char** argv) {
  Report report("contact_patches", argc, argv);
  report.remark(
      "Kept: a patch's id was in the step before too, by number and by |force|. Motion: of a kept "
      "patch's centroid over the moving solid's own in that step.");
  const std::size_t spheres = report.quick() ? 1'000 : 4'000;
  const ist::Asset a = bake_oracle_mesh("elephant", spheres);
  const ist::Asset b = bake_oracle_mesh("dino", spheres);
  const ist::PlacedAsset pa = {a.view(), {}, 1}, pb = {b.view(), {}, 1};
  const std::vector<Step> steps = read_trajectory();
  ist::Workspace workspace;
  double worst = 0;
  for (const std::size_t most : {1u, 4u, 8u, 16u, 32u}) {
    const Persistence p = follow(pa, pb, steps, most, workspace);
    const double error = wrench_error(pa, pb, steps, most, workspace);
    worst = std::max(worst, error);
    report.row("Patches along traj_eledino",
               {{"spheres", spheres},
                {"most", most},
                {"patches, mean", p.patches / static_cast<double>(steps.size())},
                {"kept %", 100 * p.kept / p.patches},
                {"kept % of force", 100 * p.kept_force / p.force},
                {"motion median", quantile(p.motion, 0.5)},
                {"motion p95", quantile(p.motion, 0.95)},
                {"time / penetration's", cost(pa, pb, steps, most, workspace)},
                {"wrench error", error}});
    if (most == 8) report.target("kept % of force, 8 patches", 100 * p.kept_force / p.force, 95);
  }
  report.target("summed wrench against the whole's, relative", worst, 1e-12, true);
  return report.write();
}
