// Exact queries beside what else tells two meshes' contact: our spheres, FCL's and Bullet's lists
// of contacts, and exact booleans (Manifold, CGAL's corefinement), which know the volume but no
// force. One thread; thread CPU time of each call; every pose fresh: a round goes over all rows of
// a class in turn, query by query; a row's time is its least of all rounds.
//
// Floor of an exact query: two thirds of its time are tests of triangle pairs. A row has 40
// (shallow) to 540 (deep) crossing pairs, and 1.6 pairs are tested by signs for one that crosses,
// each some 150 operations on eight lanes: 1 to 12 µs. The nodes on the way, some 500 to 5,000
// pairs of sixteen boxes, are another 1 to 10 µs, sums at crossings 0.1 µs each. All of it grows by
// √n with triangles.

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Surface_mesh.h>
#include <ist/bake.h>
#include <ist/pose_eigen.h>
#include <ist/query.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "manifold_mesh.h"
#include "mesh/samples/samples.h"
#include "report.h"
#include "support/bullet_mesh.h"
#include "support/fcl_mesh.h"
#include "support/oracle_rows.h"
#include "timing.h"

namespace {

using ist::Pose;
using ist::TriangleMesh;
using ist::benchmark::ManifoldMesh;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::benchmark::thread_seconds;

constexpr std::size_t kSpheres = 4000;
const std::string kExact = "ist exact", kSpheresName = "ist spheres (matched)",
                  kFcl = "FCL, all contacts", kBullet = "Bullet GImpact, all contacts",
                  kManifold = "Manifold boolean", kCgal = "CGAL corefinement";

/// B's pose in A's frame, and the exact volume if it is known.
struct Row {
  Pose pose;
  double volume = -1;
};

/// Rows that are asked in turn.
struct Class {
  std::string name;
  std::vector<Row> rows = {};
};

Eigen::Vector3d placed(const Eigen::Vector3d& x, const Pose& pose) {
  return ist::to_isometry(pose) * x;
}

/// What corefinement cuts: made anew for each call, outside the clock.
class CgalMesh {
 public:
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

  static Mesh of(const TriangleMesh& mesh, const Pose& pose) {
    Mesh out;
    for (const Eigen::Vector3d& v : mesh.vertices) {
      const Eigen::Vector3d x = placed(v, pose);
      out.add_vertex({x[0], x[1], x[2]});
    }
    for (const auto& t : mesh.triangles)
      out.add_face(Mesh::Vertex_index(t[0]), Mesh::Vertex_index(t[1]), Mesh::Vertex_index(t[2]));
    return out;
  }

  static double overlap(Mesh& a, Mesh& b) {
    Mesh both;
    namespace processing = CGAL::Polygon_mesh_processing;
    if (!processing::corefine_and_compute_intersection(a, b, both)) return -1;
    return CGAL::to_double(processing::volume(both));
  }
};

/// The two meshes of a pair as everybody sees them.
struct Pair {
  struct Body {
    explicit Body(TriangleMesh triangles, const std::string& name)
        : closed(ist::close_mesh(std::move(triangles), name)),
          asset(ist::bake(closed, {.max_spheres = kSpheres})),
          fcl(closed.mesh),
          bullet(closed.mesh),
          manifold(closed.mesh) {}
    ist::ClosedMesh closed;
    ist::Asset asset;
    ist::testing::FclMesh fcl;
    ist::testing::BulletMesh bullet;
    ManifoldMesh manifold;
  };
  Body a, b;
  ist::Workspace workspace = ist::Workspace();
  ist::testing::BulletNarrowPhase bullet = {};

  ist::Penetration ask(const Pose& pose, ist::Measure measure) {
    ist::PenetrationSettings settings;
    settings.measure = measure;
    return ist::penetration({a.asset.view(), {}, 1}, {b.asset.view(), pose, 1}, settings,
                            workspace);
  }
};

struct Query {
  std::string name;
  std::size_t rows, rounds;                      ///< most of a class
  std::function<double(const Row&)> ask;         ///< volume, or −1
  std::function<void(const Row&)> prepare = {};  ///< outside the clock
};

std::vector<Query> all_queries(Pair& pair, bool quick) {
  const std::size_t all = quick ? 10 : 1000, large = pair.a.closed.mesh.triangles.size() > 50'000;
  const std::size_t rounds = quick ? 3 : 9;
  struct Cut {
    CgalMesh::Mesh a, b;
  };
  const auto cut = std::make_shared<Cut>();
  return {
      {kExact, all, rounds,
       [&](const Row& row) { return pair.ask(row.pose, ist::Measure::exact).volume; }},
      {kSpheresName, all, rounds,
       [&](const Row& row) { return pair.ask(row.pose, ist::Measure::matched).volume; }},
      {kFcl, all, rounds,
       [&](const Row& row) {
         ist::testing::fcl_contacts(pair.a.fcl, {}, pair.b.fcl, row.pose);
         return -1.0;
       }},
      {kBullet, all, rounds,
       [&](const Row& row) {
         pair.bullet.contacts(pair.a.bullet, {}, pair.b.bullet, row.pose);
         return -1.0;
       }},
      {kManifold, large ? 20 : all, std::size_t{3},
       [&](const Row& row) { return pair.a.manifold.overlap(pair.b.manifold, row.pose); }},
      {kCgal,
       std::size_t{large   ? 2u
                   : quick ? 3u
                           : 10u},
       std::size_t{1}, [cut](const Row&) { return CgalMesh::overlap(cut->a, cut->b); },
       [&pair, cut](const Row& row) {
         *cut = {CgalMesh::of(pair.a.closed.mesh, {}), CgalMesh::of(pair.b.closed.mesh, row.pose)};
       }},
  };
}

struct Times {
  std::vector<double> us;
  double error = 0;  ///< worst, relative to the class's truths
  bool knows = false;
};

Times measure(const Query& query, const Class& of, double clock) {
  const std::size_t count = std::min(of.rows.size(), query.rows);
  // Rows of all the class, evenly.
  const auto row = [&](std::size_t i) -> const Row& { return of.rows[i * of.rows.size() / count]; };
  Times times;
  times.us.assign(count, std::numeric_limits<double>::infinity());
  for (std::size_t round = 0; round < query.rounds; ++round)
    for (std::size_t i = 0; i < count; ++i) {
      if (query.prepare) query.prepare(row(i));
      const double start = thread_seconds();
      const double volume = query.ask(row(i));
      times.us[i] = std::min(times.us[i], 1e6 * std::max(0.0, thread_seconds() - start - clock));
      const double truth = row(i).volume;
      if (volume < 0 || truth <= 0) continue;
      times.knows = true;
      times.error = std::max(times.error, std::abs(volume / truth - 1));
    }
  return times;
}

/// Times [µs] that exact queries are to keep, on a machine on which Manifold takes `manifold`.
struct Aim {
  std::string pair, name;
  double median, manifold;
};
const std::vector<Aim> kAims = {{"eledino", "0.01-0.1 %", 12, 1379},
                                {"eledino", "0.1-1 %", 20, 2099},
                                {"eledino", "1-10 %", 60, 2841},
                                {"eledino", "deep", 130, 5259}};

void report_pair(Report& report, const std::string& key, Pair& pair,
                 const std::vector<Class>& classes) {
  const double clock = ist::benchmark::clock_cost();
  const std::vector<Query> queries = all_queries(pair, report.quick());
  double worst = 0;
  for (const Class& of : classes) {
    if (of.rows.empty()) continue;
    std::vector<double> crossings;
    for (const Row& row : of.rows)
      crossings.push_back(pair.ask(row.pose, ist::Measure::exact).sphere_pairs);
    std::map<std::string, double> median;
    double p95 = 0;
    for (const Query& query : queries) {
      const Times times = measure(query, of, clock);
      median[query.name] = quantile(times.us, 0.5);
      if (query.name == kExact) {
        p95 = quantile(times.us, 0.95);
        worst = std::max(worst, times.error);
      }
      Report::Json line = {{"pair", key},
                           {"class", of.name},
                           {"crossing pairs, median", quantile(crossings, 0.5)},
                           {"query", query.name},
                           {"rows", times.us.size()},
                           {"median us", median[query.name]},
                           {"p95 us", quantile(times.us, 0.95)},
                           {"times ist exact", median[query.name] / median[kExact]}};
      if (times.knows) line["volume error, worst"] = times.error;
      report.row("Times", line);
    }
    Report::Json ratios = {{"pair", key}, {"class", of.name}, {"ist exact, us", median[kExact]}};
    for (const Query& query : queries)
      if (query.name != kExact) ratios[query.name] = median[query.name] / median[kExact];
    report.row("Medians in units of exact's", ratios);
    for (const Aim& aim : kAims) {
      if (aim.pair != key || aim.name != of.name) continue;
      const std::string what = key + ' ' + of.name + ": ";
      report.target(what + "Manifold's median by that of exact", median[kManifold] / median[kExact],
                    aim.manifold / aim.median);
      report.target(what + "p95 of exact by the median that is aimed at, Manifold's for a clock",
                    p95 / (median[kManifold] * aim.median / aim.manifold), 2.5, true);
    }
  }
  if (worst > 0) report.target(key + ": worst error of exact volumes", worst, 1e-9, true);
}

std::vector<Class> classes_of(const std::string& key) {
  std::vector<Class> classes = {{"0.01-0.1 %"}, {"0.1-1 %"}, {"1-10 %"}, {"deep"}};
  for (const ist::testing::OracleRow& row : ist::testing::read_oracle_rows(key)) {
    if (row.scale_b != 1 || (row.pose_class != "pen" && row.pose_class != "deep")) continue;
    const double part = row.fraction_of_smaller;
    const std::size_t which = row.pose_class == "deep" ? 3 : part < 1e-3 ? 0 : part < 1e-2 ? 1 : 2;
    classes[which].rows.push_back({row.pose, row.volume});
  }
  return classes;
}

/// The nut along the bolt's thread, a part of the pitch too high.
Class threaded(const std::string& name, double above) {
  Class of{name};
  for (int i = 0; i < 20; ++i) {
    const double turns = 0.125 + i / 20.0, half = std::numbers::pi * turns;
    of.rows.push_back({{{std::cos(half), 0, 0, std::sin(half)},
                        {0, 0, 8 + ist::kThreadPitch * (turns + above)}}});
  }
  return of;
}

/// Every triangle in four, on the same surface.
TriangleMesh finer(const TriangleMesh& mesh) {
  TriangleMesh out{mesh.vertices, {}, {}};
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [it, fresh] = middles.try_emplace(std::minmax(a, b), out.vertices.size());
    if (fresh) out.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]) / 2);
    return it->second;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const auto& t : {std::array{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}})
      out.triangles.push_back(t);
  }
  return out;
}

/// Elephant and dino with their triangles in 1, 4, 16 … parts.
void report_growth(Report& report) {
  const double clock = ist::benchmark::clock_cost();
  TriangleMesh a = ist::load_mesh(ist::testing::oracle_mesh_path("elephant")),
               b = ist::load_mesh(ist::testing::oracle_mesh_path("dino"));
  const std::vector<Class> classes = classes_of("eledino");
  ist::Workspace workspace;
  ist::PenetrationSettings exact;
  exact.measure = ist::Measure::exact;
  std::map<std::string, double> first;
  const std::size_t least = a.triangles.size() + b.triangles.size();
  for (int level = 0; level < (report.quick() ? 3 : 5); ++level) {
    if (level > 0) a = finer(a), b = finer(b);
    const ist::Asset asset_a = ist::bake_mesh_only(ist::close_mesh(a, "elephant")),
                     asset_b = ist::bake_mesh_only(ist::close_mesh(b, "dino"));
    const std::size_t triangles = a.triangles.size() + b.triangles.size();
    for (const Class& of : classes) {
      const Query query{kExact, 1000, report.quick() ? 3u : 9u, [&](const Row& row) {
                          return ist::penetration({asset_a.view(), {}, 1},
                                                  {asset_b.view(), row.pose, 1}, exact, workspace)
                              .volume;
                        }};
      const double us = quantile(measure(query, of, clock).us, 0.5);
      Report::Json line = {{"triangles", triangles}, {"class", of.name}, {"median us", us}};
      if (level == 0)
        first[of.name] = us;
      else
        line["exponent since the first"] =
            std::log(us / first[of.name]) / std::log(double(triangles) / double(least));
      report.row("Growth", line);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  Report report("exact_peers", argc, argv);
  report.page("Exact volumes beside contacts, spheres and booleans");
  report.remark(
      "One thread, thread CPU time less the cost of the clock; every pose fresh (rounds over all "
      "rows of a class in turn, least of the rounds a row). Assets of 4,000 spheres that hold all "
      "of their mesh's triangles.");
  report.remark(
      "FCL 0.7 (OBBRSS) and Bullet 3.24 (double precision, GImpact, margin 0) list contacts of "
      "surfaces. Manifold 3.5.4 (one thread, double, B placed by its own transform) and CGAL "
      "(exact predicates, inexact constructions; meshes copied outside the clock, few rows) make "
      "the overlap's mesh and take its volume: neither gives a force.");
  report.remark(
      "Nut on bolt: the samples, the nut at 20 places along the thread from an eighth of a turn "
      "on, "
      "in its clearance or a part of the pitch too high.");
  report.remark("Growth: elephant and dino with each triangle in 1, 4, 16 … of the same surface.");
  std::vector<std::string> keys = {"eledino", "big200k", "ico1k", "ico20k"};
  if (report.quick()) keys = {"eledino", "ico1k"};
  for (const std::string& key : keys) {
    const auto rows = ist::testing::read_oracle_rows(key);
    const auto body = [](const std::string& name) {
      return Pair::Body(ist::load_mesh(ist::testing::oracle_mesh_path(name)), name);
    };
    Pair pair{body(rows.front().mesh_a), body(rows.front().mesh_b)};
    report_pair(report, key, pair, classes_of(key));
  }
  Pair pair{Pair::Body(ist::make_sample("bolt"), "bolt"),
            Pair::Body(ist::make_sample("nut"), "nut")};
  report_pair(report, "bolt, nut", pair,
              {threaded("half a pitch off", 0.5), threaded("a quarter of a pitch off", 0.25),
               threaded("in clearance", 0)});
  report_growth(report);
  return report.write();
}
