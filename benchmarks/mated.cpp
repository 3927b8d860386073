// Exact queries beside Manifold's booleans where parts are mated: flush, coaxial, copied, and next
// to that. One thread, thread CPU time of each call; a round goes over all rows of a table in turn,
// so that no pose is asked twice in a row; a row's time is its least of all rounds.

#include <ist/bake.h>
#include <ist/mass_properties.h>
#include <ist/pose_eigen.h>
#include <ist/query.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "manifold_mesh.h"
#include "mesh/samples/samples.h"
#include "report.h"
#include "support/mated_rows.h"
#include "timing.h"

namespace {

using ist::Pose;
using ist::TriangleMesh;
using ist::benchmark::ManifoldMesh;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::benchmark::thread_seconds;
using Json = Report::Json;

struct Part {
  explicit Part(TriangleMesh triangles, const std::string& name)
      : closed(ist::close_mesh(std::move(triangles), name)),
        asset(ist::bake_mesh_only(closed)),
        manifold(closed.mesh) {}
  double volume() const { return asset.view().volume(); }
  ist::ClosedMesh closed;
  ist::Asset asset;
  ManifoldMesh manifold;
};

/// B's pose in A's frame, and what both libraries say.
struct Row {
  const Part *a, *b;
  Pose pose;
  double us = std::numeric_limits<double>::infinity(), manifold_us = us, turned_us = us;
  double manifold_volume = 0;
  ist::Penetration found = {};
};

class Clock {
 public:
  template <class Ask>
  void least(double& us, const Ask& ask) const {
    const double start = thread_seconds();
    ask();
    us = std::min(us, 1e6 * std::max(0.0, thread_seconds() - start - cost_));
  }

 private:
  double cost_ = ist::benchmark::clock_cost();
};

ist::Penetration exactly(const Part& a, const Part& b, const Pose& pose,
                         ist::Workspace& workspace) {
  ist::PenetrationSettings settings;
  settings.measure = ist::Measure::exact;
  return ist::penetration({a.asset.view(), {}, 1}, {b.asset.view(), pose, 1}, settings, workspace);
}

/// The same two, B turned by 3° about the middle of what their boxes have in common.
Pose turned(const Row& row) {
  const Eigen::Isometry3d place = ist::to_isometry(row.pose);
  Eigen::AlignedBox3d a, b;
  for (const Eigen::Vector3d& v : row.a->closed.mesh.vertices) a.extend(v);
  for (const Eigen::Vector3d& v : row.b->closed.mesh.vertices) b.extend(place * v);
  const Eigen::Vector3d middle = a.intersection(b).center();
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(3 * std::numbers::pi / 180, Eigen::Vector3d(1, 2, 3).normalized()));
  const Eigen::Quaterniond q =
      turn * Eigen::Quaterniond(row.pose.q[0], row.pose.q[1], row.pose.q[2], row.pose.q[3]);
  const Eigen::Vector3d t = middle + turn * (place.translation() - middle);
  return {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
}

void measure(std::vector<Row>& rows, int rounds, bool turn) {
  const Clock clock;
  ist::Workspace workspace;
  for (int round = 0; round < rounds; ++round) {
    for (Row& row : rows)
      clock.least(row.us, [&] { row.found = exactly(*row.a, *row.b, row.pose, workspace); });
    if (turn)
      for (Row& row : rows) {
        const Pose pose = turned(row);
        clock.least(row.turned_us, [&] { exactly(*row.a, *row.b, pose, workspace); });
      }
    // The dear one less often.
    if (round % 3 == 0)
      for (Row& row : rows)
        clock.least(row.manifold_us, [&] {
          row.manifold_volume = row.a->manifold.overlap(row.b->manifold, row.pose);
        });
  }
}

const char* name_of(ist::QueryStatus status) {
  return status == ist::QueryStatus::ok ? "ok" : "not ok";
}

/// Adds Manifold's times by ours as quantiles and targets.
void report_ratios(Report& report, const std::string& name, const std::vector<Row>& rows,
                   double least, double median) {
  std::vector<double> ratios, turned;
  std::size_t slower = 0, unfinished = 0;
  for (const Row& row : rows) {
    ratios.push_back(row.manifold_us / row.us);
    slower += row.us > row.manifold_us ? 1 : 0;
    unfinished += row.found.status != ist::QueryStatus::ok ? 1 : 0;
    if (std::isfinite(row.turned_us)) turned.push_back(row.us / row.turned_us);
  }
  report.row("Manifold's time by ours", {{"rows of", name},
                                         {"rows", rows.size()},
                                         {"worst", quantile(ratios, 0)},
                                         {"10 %", quantile(ratios, 0.1)},
                                         {"median", quantile(ratios, 0.5)},
                                         {"slower than Manifold", slower}});
  report.target(name + ": Manifold's time by ours, worst", quantile(ratios, 0), least);
  report.target(name + ": Manifold's time by ours, median", quantile(ratios, 0.5), median);
  report.target(name + ": answers that are not ok", static_cast<double>(unfinished), 0, true);
  if (!turned.empty())
    report.target(name + ": time by that of the same solids turned by 3°, worst",
                  quantile(turned, 1), 3, true);
}

/// Every row of the oracle.
void report_mates(Report& report) {
  const std::vector<ist::testing::MatedRow> oracle = ist::testing::read_mated_rows();
  std::map<std::string, Part> parts;
  const auto part = [&](const std::string& name) -> const Part* {
    const auto found = parts.find(name);
    if (found != parts.end()) return &found->second;
    TriangleMesh mesh = ist::load_mesh(ist::testing::mated_mesh_path(name));
    return &parts.try_emplace(name, std::move(mesh), name).first->second;
  };
  std::vector<Row> rows;
  for (const ist::testing::MatedRow& row : oracle)
    rows.push_back({part(row.mesh_a), part(row.mesh_b), row.pose});
  measure(rows, report.quick() ? 4 : 13, true);
  double worst = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    const double error =
        std::abs(row.found.volume - oracle[i].volume) / std::min(row.a->volume(), row.b->volume());
    worst = std::max(worst, error);
    Json line = {
        {"mate", oracle[i].name},
        {"moved", oracle[i].moved},
        {"triangles", row.a->closed.mesh.triangles.size() + row.b->closed.mesh.triangles.size()},
        {"volume", row.found.volume},
        {"error, parts of the smaller", error},
        {"status", name_of(row.found.status)},
        {"touching", row.found.touching},
        {"contact area", row.found.contact_area},
        {"crossing pairs", row.found.sphere_pairs},
        {"us", row.us},
        {"us turned by 3°", row.turned_us},
        {"Manifold us", row.manifold_us},
        {"ratio", row.manifold_us / row.us}};
    report.row("Mates", line);
  }
  report.target("mates: worst error, parts of the smaller solid", worst, 1e-12, true);
  report_ratios(report, "mates", rows, 10, 30);
}

/// Three mates over the distance from them.
void report_distances(Report& report) {
  struct Curve {
    std::string name;
    Part a, b;
    Pose pose;
    Eigen::Vector3d way;
  };
  const auto mated = [](const std::string& name) {
    return Part(ist::load_mesh(ist::testing::mated_mesh_path(name)), name);
  };
  const auto dino = [] {
    return Part(ist::load_mesh(ist::testing::oracle_mesh_path("dino")), "dino");
  };
  std::vector<Curve> curves;
  curves.push_back({"flush: plate on plate, into it",
                    mated("plate"),
                    mated("plate"),
                    {{1, 0, 0, 0}, {0, 0, 10}},
                    -Eigen::Vector3d::UnitZ()});
  curves.push_back({"coaxial: tube in tube, across",
                    mated("tube_outer"),
                    mated("tube_inner"),
                    {},
                    Eigen::Vector3d::UnitX()});
  curves.push_back({"copy: dino in place, aside", dino(), dino(), {}, Eigen::Vector3d::UnitX()});
  std::vector<double> distances = {0};
  for (int power = -12; power <= 0; ++power) distances.push_back(std::pow(10, power));
  std::vector<Row> rows;
  for (const Curve& curve : curves) {
    const double unit = curve.name.starts_with("copy") ? 1e-2 : 1;  // a hundredth of the dino
    for (const double distance : distances) {
      Row row{&curve.a, &curve.b, curve.pose};
      for (int k = 0; k < 3; ++k) row.pose.t[k] += unit * distance * curve.way[k];
      rows.push_back(row);
    }
  }
  measure(rows, report.quick() ? 4 : 22, false);
  for (std::size_t i = 0; i < rows.size(); ++i)
    report.row("Time over distance", {{"mate", curves[i / distances.size()].name},
                                      {"distance", distances[i % distances.size()]},
                                      {"volume", rows[i].found.volume},
                                      {"status", name_of(rows[i].found.status)},
                                      {"us", rows[i].us},
                                      {"Manifold us", rows[i].manifold_us}});
}

/// Meshes on their copies.
void report_copies(Report& report) {
  std::vector<std::pair<std::string, std::filesystem::path>> files;
  for (const char* name :
       {"spot.obj", "torus.off", "tray_perforated.stl", "adis16480.stl", "mug.ply", "nut_gen.ply",
        "bolt_gen.ply", "bunny_60k.ply", "dragon_174k.ply"})
    files.emplace_back(name, ist::testing::shared_path(std::string("meshes/dev/") + name));
  for (const char* name : {"elephant", "dino", "ico20k"})
    files.emplace_back(name, ist::testing::oracle_mesh_path(name));
  std::vector<std::pair<std::string, TriangleMesh>> meshes;
  for (const auto& [name, path] : files) meshes.emplace_back(name, ist::load_mesh(path));
  meshes.emplace_back("gear", ist::make_sample("gear"));
  std::vector<Row> all;
  for (auto& [name, mesh] : meshes) {
    const std::size_t triangles = mesh.triangles.size();
    if (report.quick() && triangles > 10'000) continue;
    const Part part(std::move(mesh), name);
    const double size = 2 * ist::bounds(part.asset.view()).radius;
    const std::vector<double> asides = {0, 1e-9, 1e-6, 1e-3};
    std::vector<Row> rows;
    for (const double aside : asides)
      rows.push_back({&part, &part, {{1, 0, 0, 0}, {aside * size, 0, 0}}});
    measure(rows, triangles > 50'000 ? 3 : report.quick() ? 4 : 10, false);
    for (std::size_t i = 0; i < rows.size(); ++i)
      report.row("Copies",
                 {{"mesh", name},
                  {"triangles", triangles},
                  {"aside, parts of its size", asides[i]},
                  {"status", name_of(rows[i].found.status)},
                  {"apart from Manifold, parts of the volume",
                   std::abs(rows[i].found.volume - rows[i].manifold_volume) / part.volume()},
                  {"us", rows[i].us},
                  {"Manifold us", rows[i].manifold_us},
                  {"ratio", rows[i].manifold_us / rows[i].us}});
    for (Row& row : rows) row.a = row.b = nullptr;  // of this mesh alone
    all.insert(all.end(), rows.begin(), rows.end());
  }
  report_ratios(report, "copies", all, 10, 10);
}

}  // namespace

int main(int argc, char** argv) {
  Report report("mated", argc, argv);
  report.page("Exact volumes of mated parts");
  report.remark(
      "One thread, thread CPU time less the cost of the clock; rounds over all rows of a table in "
      "turn, least of the rounds a row. Manifold 3.5.4: one thread, double.");
  report.remark(
      "Mates: twelve parts of a CAD kernel in eighteen mates, each also moved by 1e-9 to 0.1 mm "
      "along the mate; the truth is Manifold's, in double. The same two solids are asked again "
      "with B "
      "turned by 3° about the middle of what their boxes have in common.");
  report.remark("Time over distance: in mm, the dino in hundredths of its size.");
  report.remark("Copies: a mesh on its copy, moved along x.");
  report_mates(report);
  report_distances(report);
  report_copies(report);
  return report.write();
}
