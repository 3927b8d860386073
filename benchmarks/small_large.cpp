// A small solid against a large one, and flat contact: lenses alone, the default, which goes over
// to the meshes, and these alone, in the same run.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include <ist/bake.h>
#include <ist/query.h>
#include <ist/shapes.h>

#include "report.h"
#include "support/oracle_rows.h"
#include "support/test_meshes.h"
#include "support/turns.h"
#include "timing.h"

namespace {

using Eigen::Vector3d;
using ist::PlacedAsset;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::testing::degrees_between;

/// A pose with the exact answer; volume 0 where the solids are apart.
struct Row {
  std::string a, b, kind;
  double ratio = 1, depth = 0;
  ist::Pose pose;
  double scale_b = 1;
  double volume = 0;
  Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero();
};

std::string mesh_path(const std::string& name) {
  for (const char* const folder : {"oracle/meshes/", "meshes/dev/"}) {
    for (const char* const suffix : {".off", ".ply", ".stl", ".obj"}) {
      const auto path = ist::testing::shared_path(folder + name + suffix);
      if (std::filesystem::exists(path)) return path.string();
    }
  }
  throw std::runtime_error("no mesh " + name);
}

class Assets {
 public:
  explicit Assets(std::size_t spheres) : spheres_(spheres) {}
  const ist::Asset& of(std::string name) {
    const std::string suffix = "_small";
    if (name.ends_with(suffix)) name.resize(name.size() - suffix.size());
    const auto known = made_.find(name);
    if (known != made_.end()) return known->second;
    return add(name, ist::load_mesh(mesh_path(name)));
  }
  const ist::Asset& add(const std::string& name, ist::TriangleMesh mesh) {
    const ist::ClosedMesh closed = ist::close_mesh(std::move(mesh), name);
    return made_.emplace(name, ist::bake(closed, {.max_spheres = spheres_})).first->second;
  }

 private:
  std::size_t spheres_;
  std::map<std::string, ist::Asset> made_;
};

std::vector<Row> small_rows(const std::string& key) {
  const std::string folder = ist::testing::shared_path("oracle/small").string();
  const auto poses = ist::testing::read_csv(folder + "/" + key + ".csv");
  const auto truths = ist::testing::read_csv(folder + "/truth_" + key + ".csv");
  std::vector<Row> rows;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto pose = [&](const char* column) { return std::stod(poses[i].at(column)); };
    const auto truth = [&](const char* column) { return std::stod(truths[i].at(column)); };
    Row row;
    row.a = poses[i].at("meshA");
    row.b = poses[i].at("meshB");
    row.kind = poses[i].at("class");
    row.ratio = truth("ratio");
    row.depth = truth("depth");
    row.pose = {{pose("qw"), pose("qx"), pose("qy"), pose("qz")},
                {pose("tx"), pose("ty"), pose("tz")}};
    row.scale_b = pose("scale_b");
    row.volume = truth("volume");
    row.force = -Eigen::Vector3d(truth("dVdtx"), truth("dVdty"), truth("dVdtz"));
    row.torque = -Eigen::Vector3d(truth("dVdrx"), truth("dVdry"), truth("dVdrz"));
    rows.push_back(row);
  }
  return rows;
}

std::vector<Row> like_sized_rows(const std::string& key) {
  std::vector<Row> rows;
  for (const ist::testing::OracleRow& from : ist::testing::read_oracle_rows(key)) {
    Row row;
    row.a = from.mesh_a, row.b = from.mesh_b;
    row.pose = from.pose, row.scale_b = from.scale_b;
    row.volume = from.volume;
    row.force = from.force, row.torque = from.torque;
    const double part = from.fraction_of_smaller;
    row.kind = from.pose_class != "pen" ? from.pose_class
               : part >= 0.01           ? "1–10 %"
               : part >= 0.001          ? "0.1–1 %"
                                        : "0.01–0.1 %";
    rows.push_back(row);
  }
  return rows;
}

/// What one method makes of a class.
struct Measured {
  std::vector<double> volume, angle, torque, time;  ///< relative, degrees, relative, µs
  std::vector<double> pairs;                        ///< Penetration::sphere_pairs
  std::size_t nothing = 0;                          ///< rows that read 0 and are not
};

constexpr std::size_t kMethods = 3;
constexpr const char* kNames[kMethods] = {"lenses", "default", "exact"};
constexpr std::size_t kLenses = 0, kExact = 2;
using Methods = std::array<Measured, kMethods>;

/// Asks all rows, each pose between others, all ways by turns; a row's time is the median of its
/// turns.
std::map<std::string, Methods> measure(const std::vector<Row>& rows, Assets& assets, int turns) {
  struct Placed {
    PlacedAsset a, b;
  };
  std::vector<Placed> placed;
  for (const Row& row : rows)
    placed.push_back(
        {{assets.of(row.a).view(), {}, 1}, {assets.of(row.b).view(), row.pose, row.scale_b}});
  std::vector<std::size_t> order(rows.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::mt19937_64 random(3);
  std::vector<std::array<std::vector<double>, kMethods>> times(rows.size());
  std::vector<std::array<ist::Penetration, kMethods>> answers(rows.size());
  ist::Workspace workspace;
  for (int turn = 0; turn <= turns; ++turn) {
    std::shuffle(order.begin(), order.end(), random);
    for (std::size_t method = 0; method < kMethods; ++method) {
      ist::PenetrationSettings settings;
      settings.spheres_only = method == kLenses;
      if (method == kExact) settings.measure = ist::Measure::exact;
      for (const std::size_t i : order) {
        const auto start = std::chrono::steady_clock::now();
        answers[i][method] = ist::penetration(placed[i].a, placed[i].b, settings, workspace);
        const std::chrono::duration<double, std::micro> took =
            std::chrono::steady_clock::now() - start;
        if (turn > 0) times[i][method].push_back(took.count());  // the first turn meets cold pages
      }
    }
  }
  std::map<std::string, Methods> by_class;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    for (std::size_t method = 0; method < kMethods; ++method) {
      Measured& m = by_class[row.kind][method];
      const ist::Penetration& got = answers[i][method];
      m.time.push_back(quantile(times[i][method], 0.5));
      m.pairs.push_back(got.sphere_pairs);
      if (!(row.volume > 0)) continue;
      m.volume.push_back(100 * std::abs(got.volume / row.volume - 1));
      m.nothing += got.volume > 0 ? 0 : 1;
      if (row.kind == "contain") continue;  // feels no force
      // Who reads 0 has no direction: that is counted by itself.
      if (got.volume > 0) m.angle.push_back(degrees_between(got.force, row.force));
      // A ball has no torque about its own centre: a tenth of what the force has at B's rim is the
      // least that an error is measured by. The meshes' diameter is 1.
      const double least = 0.1 * row.force.norm() * 0.5 * row.scale_b;
      m.torque.push_back(100 * (got.torque - row.torque).norm() /
                         std::max(row.torque.norm(), least));
    }
  }
  return by_class;
}

double median(const std::vector<double>& values) { return quantile(values, 0.5); }

Report::Json columns(const Methods& methods) {
  Report::Json row;
  row["rows"] = methods[0].time.size();
  const auto each = [&](const char* what, auto value) {
    for (std::size_t k = 0; k < kMethods; ++k)
      row[std::string(kNames[k]) + " " + what] = value(methods[k]);
  };
  if (!methods[0].volume.empty()) {
    each("volume median %", [](const Measured& m) { return median(m.volume); });
    each("volume p95 %", [](const Measured& m) { return quantile(m.volume, 0.95); });
    each("read 0", [](const Measured& m) { return m.nothing; });
  }
  if (!methods[0].angle.empty()) {
    each("angle median °", [](const Measured& m) { return median(m.angle); });
    each("angle p95 °", [](const Measured& m) { return quantile(m.angle, 0.95); });
    each("rotation gradient median %", [](const Measured& m) { return median(m.torque); });
  }
  each("median µs", [](const Measured& m) { return median(m.time); });
  each("p95 µs", [](const Measured& m) { return quantile(m.time, 0.95); });
  row["crossing pairs median"] = median(methods[kExact].pairs);
  each("max µs", [](const Measured& m) { return quantile(m.time, 1); });
  row["time ratio"] = median(methods[1].time) / median(methods[0].time);
  return row;
}

/// What is aimed at; 0: nothing.
struct Aims {
  double volume[3];  ///< [%] at depths 0.02, 0.05, 0.2
  double angle, angle_p95;
};

const Aims* aims_of(const std::string& key, double ratio) {
  static const Aims kFar{{0.8, 0.4, 0.5}, 1.5, 12}, kNear{{3, 0.8, 0.4}, 3, 20},
      kMugFar{{3.5, 1, 0.3}, 2, 10}, kMugNear{{5, 2, 0.4}, 2, 10};
  if (key == "small_mug_ico1k") return ratio <= 0.1 ? &kMugFar : &kMugNear;
  if (key.starts_with("small_")) return ratio <= 0.1 ? &kFar : &kNear;
  return nullptr;
}

void small_pairs(Report& report, Assets& assets, int turns) {
  for (const char* const name :
       {"small_table_dino", "small_elephant_dino", "small_mug_ico1k", "thin_mug_torus",
        "thin_tray_perforated_sword", "thin_tray_perforated_torus"}) {
    const std::string key = name;
    const std::vector<Row> rows = small_rows(key);
    std::map<std::string, Row> first;
    for (const Row& row : rows) first.emplace(row.kind, row);
    std::map<double, std::vector<double>> torques;
    std::vector<double> times;
    for (const auto& [kind, methods] : measure(rows, assets, turns)) {
      const double ratio = first[kind].ratio, depth = first[kind].depth;
      Report::Json row = {{"pair", key}, {"ratio", ratio}, {"depth", depth}};
      row.update(columns(methods));
      report.row("Small against large", row);
      const Measured& got = methods[1];
      const Aims* const aims = aims_of(key, ratio);
      if (aims == nullptr) continue;
      times.insert(times.end(), got.time.begin(), got.time.end());
      torques[ratio].insert(torques[ratio].end(), got.torque.begin(), got.torque.end());
      const std::string of = ", " + key + " " + kind;
      report.target("volume error median %" + of, median(got.volume),
                    aims->volume[depth < 0.03  ? 0
                                 : depth < 0.1 ? 1
                                               : 2],
                    true);
      report.target("force angle median °" + of, median(got.angle), aims->angle, true);
      report.target("force angle p95 °" + of, quantile(got.angle, 0.95), aims->angle_p95, true);
      report.target("rows that read 0" + of, static_cast<double>(got.nothing), 0, true);
    }
    for (const auto& [ratio, errors] : torques)
      report.target(
          "rotation gradient error median %, " + key + " ratio " + Report::Json(ratio).dump(),
          median(errors), 2, true);
    if (times.empty()) continue;
    report.target("time median µs, " + key, median(times), 8, true);
    report.target("time max µs, " + key, quantile(times, 1), 50, true);
  }
}

void like_sized(Report& report, Assets& assets, int turns) {
  for (const char* const key : {"eledino", "big200k"}) {
    for (const auto& [kind, methods] : measure(like_sized_rows(key), assets, turns)) {
      Report::Json row = {{"pair", key}, {"class", kind}};
      row.update(columns(methods));
      report.row("Like sizes", row);
      const Measured &lenses = methods[0], &got = methods[1];
      const std::string of = std::string(", ") + key + " " + kind;
      report.target("time over lenses'" + of, median(got.time) / median(lenses.time), 1.25, true);
      if (got.volume.empty()) continue;
      const double before = median(lenses.volume);
      const double limit = kind == "contain"      ? 0.02
                           : kind == "0.01–0.1 %" ? 3.2
                                                  : std::max(before * 4 / 3, before + 0.05);
      report.target("volume error median %" + of, median(got.volume), limit, true);
      if (got.angle.empty()) continue;
      report.target("force angle median °" + of, median(got.angle), median(lenses.angle) + 0.3,
                    true);
      report.target("force angle p95 °" + of, quantile(got.angle, 0.95),
                    1.5 * quantile(lenses.angle, 0.95), true);
    }
  }
}

/// B in random turns at random places of A's surface, part of its way in. The true answer is that
/// of Measure::exact, which the rows above and its interval vouch for.
std::vector<Row> unseen_rows(const std::string& a, const std::string& b, double ratio,
                             Assets& assets) {
  const ist::TriangleMesh mesh_a = ist::load_mesh(mesh_path(a)),
                          mesh_b = ist::load_mesh(mesh_path(b));
  const auto diagonal = [](const ist::TriangleMesh& mesh) {
    Eigen::AlignedBox3d box;
    for (const Vector3d& v : mesh.vertices) box.extend(v);
    return box.diagonal().norm();
  };
  std::mt19937_64 random(71);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0, 1);
  const auto direction = [&] {
    const double x = normal(random), y = normal(random), z = normal(random);
    return Vector3d(x, y, z).normalized();
  };
  ist::Workspace workspace;
  ist::PenetrationSettings exact;
  exact.measure = ist::Measure::exact;
  const double size = ratio * diagonal(mesh_a), scale_b = size / diagonal(mesh_b);
  std::vector<Row> rows;
  for (int tries = 0; tries < 2000 && rows.size() < 60; ++tries) {
    const auto& t = mesh_a.triangles[random() % mesh_a.triangles.size()];
    const double u = std::sqrt(unit(random)), v = unit(random);
    const Vector3d p = mesh_a.vertices[t[0]] * (1 - u) + mesh_a.vertices[t[1]] * (u * (1 - v)) +
                       mesh_a.vertices[t[2]] * (u * v);
    const Vector3d n = (mesh_a.vertices[t[1]] - mesh_a.vertices[t[0]])
                           .cross(mesh_a.vertices[t[2]] - mesh_a.vertices[t[0]])
                           .normalized();
    if (!(n.norm() > 0.5)) continue;
    const Vector3d axis = direction();
    const double half = unit(random) * std::numbers::pi / 2;
    const Eigen::Quaterniond q(std::cos(half), axis[0] * std::sin(half), axis[1] * std::sin(half),
                               axis[2] * std::sin(half));
    double low = 0;
    for (const Vector3d& x : mesh_b.vertices) low = std::min(low, n.dot(q * (scale_b * x)));
    const double depth = 0.005 * std::pow(60.0, unit(random));
    const Vector3d at = p + n * (-low - depth * size);
    Row row;
    row.a = a, row.b = b, row.ratio = ratio, row.depth = depth;
    row.kind = "all depths";
    row.pose = {{q.w(), q.x(), q.y(), q.z()}, {at[0], at[1], at[2]}};
    row.scale_b = scale_b;
    const ist::Penetration truth = ist::penetration(
        {assets.of(a).view(), {}, 1}, {assets.of(b).view(), row.pose, scale_b}, exact, workspace);
    if (truth.status != ist::QueryStatus::ok || !(truth.volume > 0)) continue;
    row.volume = truth.volume;
    row.force = truth.force, row.torque = truth.torque;
    rows.push_back(row);
  }
  return rows;
}

void unseen_pairs(Report& report, Assets& assets, int turns) {
  constexpr std::pair<const char*, const char*> kPairs[] = {
      {"spot", "torus"},          {"sword", "spot"},
      {"tray_perforated", "mug"}, {"bunny_60k", "nut_gen"},
      {"unit_cube", "adis16480"}, {"torus", "bunny_60k"},
      {"elephant200k", "spot"},   {"hole_tray_round_16mm", "peg_round_16mm"}};
  for (const auto& [a, b] : kPairs)
    for (const double ratio : {1.0, 0.3, 0.1, 0.03}) {
      const std::vector<Row> rows = unseen_rows(a, b, ratio, assets);
      for (const auto& [kind, methods] : measure(rows, assets, turns)) {
        const Measured &lenses = methods[0], &usual = methods[1], &exact = methods[kExact];
        report.row("Unseen pairs",
                   {{"pair", std::string(a) + ", " + b},
                    {"ratio", ratio},
                    {"rows", rows.size()},
                    {"crossing pairs median", median(exact.pairs)},
                    {"lenses volume median %", median(lenses.volume)},
                    {"default volume median %", median(usual.volume)},
                    {"default volume p95 %", quantile(usual.volume, 0.95)},
                    {"default angle median °", median(usual.angle)},
                    {"lenses median µs", median(lenses.time)},
                    {"default median µs", median(usual.time)},
                    {"default p95 µs", quantile(usual.time, 0.95)},
                    {"exact median µs", median(exact.time)},
                    {"exact p95 µs", quantile(exact.time, 0.95)},
                    {"exact over default", median(exact.time) / median(usual.time)}});
      }
    }
}

/// Dino in random turns, its lowest point at depths of 0.1 to 20 % under a plane or a box's top.
void planes(Report& report, Assets& assets, int turns) {
  const ist::AssetView dino = assets.of("dino").view();
  const ist::TriangleMesh mesh = ist::load_mesh(mesh_path("dino"));
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  std::vector<PlacedAsset> poses;
  for (int i = 0; i < 60; ++i) {
    const double w = normal(random), x = normal(random), y = normal(random), z = normal(random);
    const Eigen::Quaterniond q = Eigen::Quaterniond(w, x, y, z).normalized();
    double low = 0;
    for (const Vector3d& v : mesh.vertices) low = std::min(low, (q * v).z());
    const double depth = 0.001 * std::pow(200.0, i / 59.0);
    poses.push_back({dino, {{q.w(), q.x(), q.y(), q.z()}, {0, 0, -low - depth}}, 1});
  }
  ist::Workspace workspace;
  const std::pair<const char*, ist::PlacedShape> fields[] = {
      {"half-space", {ist::HalfSpaceShape{}, {}, 1}},
      {"box", {ist::BoxShape{{2, 2, 0.5}}, {{1, 0, 0, 0}, {0, 0, -0.5}}, 1}}};
  for (const auto& [name, field] : fields) {
    std::vector<std::vector<double>> times(poses.size());
    double sum = 0;
    for (int turn = 0; turn <= turns; ++turn) {
      for (std::size_t k = 0; k < poses.size(); ++k) {
        const std::size_t i = (k * 37 + static_cast<std::size_t>(turn)) % poses.size();
        const auto start = std::chrono::steady_clock::now();
        sum += ist::penetration(field, poses[i], {}, workspace).volume;
        const std::chrono::duration<double, std::micro> took =
            std::chrono::steady_clock::now() - start;
        if (turn > 0) times[i].push_back(took.count());
      }
    }
    std::vector<double> all;
    for (const auto& of_pose : times) all.push_back(median(of_pose));
    report.row("Fields and dino", {{"field", name},
                                   {"poses", poses.size()},
                                   {"median µs", median(all)},
                                   {"p95 µs", quantile(all, 0.95)},
                                   {"max µs", quantile(all, 1)},
                                   {"mean volume", sum / ((turns + 1) * 60.0)}});
    report.target(std::string("time median µs, ") + name + " and dino", median(all), 2, true);
  }
}

/// A cube at rest on flat faces, at gaps of −3 to +3 % of its side. Exact: the side's square times
/// the depth, and the square for a force.
void flat_rests(Report& report, Assets& assets) {
  const ist::Asset& cube = assets.add("cube", ist::testing::cube_mesh());
  ist::Workspace workspace;
  const double scale = 0.999;  // not the fixed one's own size, or the two are copies
  double worst_volume = 0, worst_force = 0;
  for (const double gap :
       {-0.03, -0.02, -0.01, -0.005, -0.002, 0.0, 0.002, 0.005, 0.01, 0.02, 0.03}) {
    const double side = scale;
    const PlacedAsset body{cube.view(), {{1, 0, 0, 0}, {0, 0, (gap + 0.5) * side}}, scale};
    const PlacedAsset under{cube.view(), {{1, 0, 0, 0}, {0, 0, -0.5}}, 1};
    const double exact = std::max(0.0, -gap) * side * side * side;
    const double exact_force = gap < 0 ? side * side : 0;
    Report::Json row = {{"gap / side", gap}, {"exact volume", exact}, {"exact force", exact_force}};
    const auto add = [&](const std::string& name, const ist::Penetration& got) {
      row[name + " volume"] = got.volume;
      row[name + " force"] = got.force.norm();
      if (name == "half-space" || name == "box") {
        worst_volume = std::max(worst_volume, std::abs(got.volume - exact));
        worst_force = std::max(worst_force, std::abs(got.force.norm() - exact_force));
      }
    };
    add("half-space",
        ist::penetration(ist::PlacedShape{ist::HalfSpaceShape{}, {}, 1}, body, {}, workspace));
    add("box", ist::penetration(
                   ist::PlacedShape{ist::BoxShape{{2, 2, 0.5}}, {{1, 0, 0, 0}, {0, 0, -0.5}}, 1},
                   body, {}, workspace));
    ist::PenetrationSettings settings;
    settings.spheres_only = true;
    add("cube by lenses", ist::penetration(under, body, settings, workspace));
    settings.measure = ist::Measure::exact;
    add("cube by meshes", ist::penetration(under, body, settings, workspace));
    report.row("Flat rests", row);
  }
  report.remark("Flat rests on a half-space or a box: the volume is off by " +
                Report::Json(worst_volume).dump() + " side³ at most, the force by " +
                Report::Json(worst_force).dump() +
                " side²: what the balls of the body protrude from its own faces.");
}

}  // namespace

int main(int argc, char** argv) {
  Report report("small_large", argc, argv);
  const std::size_t spheres = report.quick() ? 1'000 : 4'000;
  const int turns = report.quick() ? 3 : 15;
  report.remark(std::to_string(spheres) +
                " spheres each. Lenses: PenetrationSettings::spheres_only; default: the default "
                "settings; exact: Measure::exact; in the same run by turns. Every pose "
                "stands between others; the "
                "time of a pose is the median "
                "of its " +
                std::to_string(turns) + " turns, wall clock.");
  report.remark(
      "Ratio: B's diagonal to A's; depth in B's diagonals; errors and angles against exact "
      "booleans; read 0: rows that overlap and are said not to. Rotation gradients: relative to "
      "the exact one, or to a tenth of the force at B's rim where that is more.");
  report.remark(
      "Unseen pairs: B in 60 random turns at random places of A's surface, 0.5 to 30 % of its "
      "diagonal deep; the truth is Measure::exact, whose volumes are the booleans' "
      "to 1e-7 and better in the table before.");
  Assets assets(spheres);
  small_pairs(report, assets, turns);
  unseen_pairs(report, assets, turns);
  planes(report, assets, turns);
  flat_rests(report, assets);
  like_sized(report, assets, turns);
  return report.write();
}
