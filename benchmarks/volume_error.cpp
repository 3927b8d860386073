// How exact the answers are: bakes the oracle's meshes and asks all of its rows, then solids laid
// against their own copies, where both sets of spheres repeat each other and the error is worst.

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include <ist/bake.h>
#include <ist/query.h>

#include "mesh/mesh_solid.h"
#include "mesh/samples/samples.h"
#include "report.h"
#include "support/oracle_rows.h"
#include "timing.h"

namespace {

using Eigen::Vector3d;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::testing::OracleRow;

const std::array<std::string, 5> kClasses = {"contained", "10–50 %", "1–10 %", "0.1–1 %",
                                             "0.01–0.1 %"};

/// Class of a row that overlaps: index into kClasses.
std::size_t class_of(const OracleRow& row) {
  if (row.pose_class == "contain") return 0;
  if (row.fraction_of_smaller >= 0.1) return 1;
  if (row.fraction_of_smaller >= 0.01) return 2;
  return row.fraction_of_smaller >= 0.001 ? 3 : 4;
}

double degrees_between(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

/// What is asked of pair key `eledino`: median relative volume error a class, 0 where nothing is.
std::array<double, 5> volume_limits(std::size_t spheres) {
  if (spheres == 4'000) return {0.0015, 0.0005, 0.002, 0.006, 0.07};
  if (spheres == 16'000) return {0, 0, 0, 0.0025, 0.03};
  return {};
}

struct ErrorsOfClass {
  std::vector<double> volume, inner_volume, angle;  ///< relative, relative, degrees
  std::size_t found = 0;
};

/// Median errors of one class, from few spheres to many.
using Medians = std::vector<std::pair<std::size_t, double>>;

/// p of error ~ spheres^−p: the slope of the straight line that fits the logarithms best.
double convergence_order(const Medians& medians) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const auto& [spheres, error] : medians) {
    const double u = std::log(static_cast<double>(spheres)), v = std::log(error);
    n += 1, x += u, y += v, xx += u * u, xy += u * v;
  }
  return -(n * xy - x * y) / (n * xx - x * x);
}

/// Returns the median error of the volume by class.
std::map<std::size_t, double> ask_oracle_rows(Report& report, const std::string& key,
                                              std::size_t spheres) {
  const std::vector<OracleRow> rows = ist::testing::read_oracle_rows(key);
  std::map<std::string, ist::Asset> assets;
  const auto asset = [&](const std::string& mesh) -> const ist::Asset& {
    const std::string path = ist::testing::oracle_mesh_path(mesh);  // one for X and X_small
    const auto known = assets.find(path);
    if (known != assets.end()) return known->second;
    const ist::ClosedMesh closed = ist::close_mesh(ist::load_mesh(path), mesh);
    return assets.emplace(path, ist::bake(closed, {.max_spheres = spheres})).first->second;
  };

  ist::Workspace workspace;
  std::map<std::size_t, ErrorsOfClass> errors;
  std::vector<double> widths;
  std::size_t outside_interval = 0;
  for (const OracleRow& row : rows) {
    const ist::PlacedTree a = {asset(row.mesh_a).view(), {}, 1};
    const ist::PlacedTree b = {asset(row.mesh_b).view(), row.pose, row.scale_b};
    const ist::Separation gap = ist::separation(a, b, {}, workspace);
    const double distance = row.solid_distance();
    if (distance < gap.distance_min || distance > gap.distance_max) ++outside_interval;
    if (row.pose_class == "sep") {
      widths.push_back(gap.distance_max - gap.distance_min);
      continue;
    }
    const ist::Penetration matched = ist::penetration(a, b, {}, workspace);
    const ist::Penetration inner =
        ist::penetration(a, b, {.measure = ist::Measure::inner}, workspace);
    ErrorsOfClass& error = errors[class_of(row)];
    error.volume.push_back(std::abs(matched.volume / row.volume - 1));
    error.inner_volume.push_back(std::abs(inner.volume / row.volume - 1));
    if (matched.volume > 0) ++error.found;
    if (class_of(row) != 0)  // a contained solid feels no force
      error.angle.push_back(
          degrees_between(matched.translation_gradient, row.translation_gradient));
  }

  const std::string of = key + ", " + std::to_string(spheres) + " spheres";
  const std::array<double, 5> limits = volume_limits(spheres);
  std::map<std::size_t, double> medians;
  for (const auto& [k, error] : errors) {
    medians[k] = quantile(error.volume, 0.5);
    report.row("Volume and force against exact booleans",
               {{"pair", key},
                {"spheres", spheres},
                {"class", kClasses[k]},
                {"rows", error.volume.size()},
                {"found", error.found},
                {"error median %", 100 * quantile(error.volume, 0.5)},
                {"error p95 %", 100 * quantile(error.volume, 0.95)},
                {"inner median %", 100 * quantile(error.inner_volume, 0.5)},
                {"force angle median °", quantile(error.angle, 0.5)},
                {"force angle p95 °", quantile(error.angle, 0.95)}});
    if (k == 0)
      report.target("contained rows found, " + of, static_cast<double>(error.found),
                    static_cast<double>(error.volume.size()));
    if (key != "eledino") continue;
    if (limits[k] > 0)
      report.target("median volume error %, " + kClasses[k] + ", " + of,
                    100 * quantile(error.volume, 0.5), 100 * limits[k], true);
    if (k > 0 && spheres >= 4'000)
      report.target("force angle p95 °, " + kClasses[k] + ", " + of, quantile(error.angle, 0.95),
                    k < 4 ? 5 : 10, true);
  }
  report.row("Separation", {{"pair", key},
                            {"spheres", spheres},
                            {"rows", rows.size()},
                            {"true distance outside the interval", outside_interval},
                            {"interval width median / D, sep rows", quantile(widths, 0.5)},
                            {"p95", quantile(widths, 0.95)}});
  report.target("true distance outside the interval, " + of, static_cast<double>(outside_interval),
                0, true);
  if (key == "eledino" && spheres == 4'000)
    report.target("interval width median / D, " + of, quantile(widths, 0.5), 0.02, true);
  return medians;
}

/// Volumes [u³] of a solid's overlaps with its copies moved by `shifts` along x: columns along x,
/// exact in their direction, on a grid so dense that its own error is far below what is measured.
std::vector<double> overlaps_with_moved_copies(const ist::MeshSolid& solid,
                                               const std::vector<double>& shifts) {
  constexpr int kColumns = 1'000;
  const double scale = solid.frame().scale();
  const Vector3d low = solid.frame().to_unit(solid.bounds().min());
  const Vector3d size = solid.bounds().sizes() / scale;
  const double area = size.y() * size.z() / (double{kColumns} * kColumns);
  std::vector<double> volumes(shifts.size());
  std::vector<ist::Crossing> crossings, both;
  for (int j = 0; j < kColumns; ++j)
    for (int i = 0; i < kColumns; ++i) {
      const double y = low.y() + (i + 0.5) / kColumns * size.y();
      const double z = low.z() + (j + 0.5) / kColumns * size.z();
      solid.line_crossings(y, z, crossings);
      for (std::size_t s = 0; s < shifts.size(); ++s) {
        both = crossings;
        for (const ist::Crossing& c : crossings) both.push_back({c.x + shifts[s] / scale, c.sign});
        std::sort(both.begin(), both.end(), [](const auto& a, const auto& b) { return a.x < b.x; });
        int winding = 0;  // 2: inside of both, as the samples overlap themselves nowhere
        for (std::size_t k = 0; k + 1 < both.size(); ++k) {
          winding += both[k].sign;
          if (winding == 2)
            volumes[s] += (both[k + 1].x - both[k].x) * area * scale * scale * scale;
        }
      }
    }
  return volumes;
}

/// A sample and its copy, with equal axes, side by side along the sample's z axis.
void ask_aligned_copies(Report& report, const std::string& name, std::size_t spheres) {
  ist::TriangleMesh mesh = ist::make_sample(name);
  for (Vector3d& v : mesh.vertices) v = Vector3d(v.z(), v.x(), v.y());
  const ist::ClosedMesh closed = ist::close_mesh(std::move(mesh), name);
  const ist::MeshSolid solid(closed);
  const ist::Asset asset = ist::bake(closed, {.max_spheres = spheres});
  ist::Workspace workspace;
  const double side = solid.bounds().sizes().x();
  std::vector<std::string> placements = {"coincident", "half a side apart"};
  std::vector<double> shifts = {0, 0.5 * side};
  for (const double gap : {-0.03, -0.01, -0.003, 0.0, 0.003, 0.01}) {
    char text[32];
    std::snprintf(text, sizeof text, "face to face, gap %+.3f", gap);
    placements.emplace_back(text);
    shifts.push_back((1 + gap) * side);
  }
  const std::vector<double> exact = overlaps_with_moved_copies(solid, shifts);
  for (std::size_t k = 0; k < shifts.size(); ++k) {
    const ist::Pose pose = {{1, 0, 0, 0}, {shifts[k], 0, 0}};
    const double volume =
        ist::penetration({asset.view(), {}, 1}, {asset.view(), pose, 1}, {}, workspace).volume;
    Report::Json row = {{"solid", name},
                        {"spheres", spheres},
                        {"placement", placements[k]},
                        {"volume, % of the solid", 100 * volume / solid.volume()},
                        {"exact %", 100 * exact[k] / solid.volume()}};
    if (exact[k] > 1e-9 * solid.volume()) row["error %"] = 100 * (volume / exact[k] - 1);
    report.row("Aligned copies", row);
  }
}

}  // namespace

int main(int argc, char** argv) {
  Report report("volume_error", argc, argv);
  report.remark(
      "Relative errors of the matched volume; the inner measure, a lower bound, beside it. Force "
      "angle: between the returned translation gradient and the exact one.");
  report.remark(
      "Classes by overlap over the smaller solid's volume. D is the diameter of the meshes.");
  report.remark(
      "Aligned copies: sides and gaps along the sample's z axis, gaps as parts of the side; exact "
      "volumes by a million columns.");
  report.remark(
      "Convergence: the error falls as spheres^(−order), fitted over all counts. A ball (ico1k, "
      "ico20k) is one sphere and begins at its floor.");
  const std::vector<std::size_t> counts =
      report.quick() ? std::vector<std::size_t>{300, 1'000}
                     : std::vector<std::size_t>{300, 1'000, 4'000, 16'000, 30'000};
  std::map<std::pair<std::string, std::size_t>, Medians> medians;  // by pair and class
  for (const std::size_t spheres : counts) {
    for (const std::string& key : ist::testing::kPairKeys)
      for (const auto& [k, median] : ask_oracle_rows(report, key, spheres))
        medians[{key, k}].emplace_back(spheres, median);
    for (const std::string name : {"cube", "bolt", "gear"})
      ask_aligned_copies(report, name, spheres);
  }
  for (const auto& [of, errors] : medians) {
    const double order = convergence_order(errors);
    report.row(
        "Convergence",
        {{"pair", of.first},
         {"class", kClasses[of.second]},
         {"error median % at " + std::to_string(errors.front().first), 100 * errors.front().second},
         {"at " + std::to_string(errors.back().first), 100 * errors.back().second},
         {"order", order}});
    if (of.first == "eledino" || of.first == "big200k")
      report.target("order of convergence, " + kClasses[of.second] + ", " + of.first, order, 0.5);
  }
  return report.write();
}
