// How exact the answers are: bakes the oracle's meshes and asks all of its rows.

#include <array>
#include <cmath>
#include <map>

#include <ist/bake.h>
#include <ist/query.h>

#include "report.h"
#include "support/oracle_rows.h"
#include "support/turns.h"
#include "timing.h"

namespace {

using Eigen::Vector3d;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::testing::degrees_between;
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
    const ist::PlacedAsset a = {asset(row.mesh_a).view(), {}, 1};
    const ist::PlacedAsset b = {asset(row.mesh_b).view(), row.pose, row.scale_b};
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
      error.angle.push_back(degrees_between(matched.force, row.force));
  }

  const std::string of = key + ", " + std::to_string(spheres) + " spheres";
  if (key == "eledino" && spheres >= 4'000) {
    std::vector<double> angles;  // of all rows that overlap by 0.1 % or more
    for (const std::size_t k : {1u, 2u, 3u})
      angles.insert(angles.end(), errors[k].angle.begin(), errors[k].angle.end());
    report.target("force angle p95 °, 0.1–50 %, " + of, quantile(angles, 0.95), 4, true);
  }
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

}  // namespace

int main(int argc, char** argv) {
  Report report("volume_error", argc, argv);
  report.remark(
      "Relative errors of the matched volume; the inner measure, a lower bound, beside it. Force "
      "angle: between the returned translation gradient and the exact one.");
  report.remark(
      "Classes by overlap over the smaller solid's volume. D is the diameter of the meshes.");
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
