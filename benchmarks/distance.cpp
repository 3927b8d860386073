// Distances beside FCL and Coal: from scratch, in a loop, bounded, and beside the overlap of solids
// that cross. One thread; thread CPU time of each call; every pose fresh: a round goes over all
// rows of a scene in turn, and a row's time is its least of the rounds.
//
// Floor of a distance from scratch, in operations: a node is sixteen boxes against one, 150 each,
// in floats; two blocks are 16 triangles against those of their rows that are left, 60 each; two
// triangles are 1,000 in double. A generic pose opens some 50 nodes, looks at 15 pairs of blocks
// and measures 30 pairs of triangles: 160,000 operations, eight or four at a time, and 100 kB.

#include <ist/bake.h>
#include <ist/query.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <numbers>

#include "mesh/samples/samples.h"
#include "report.h"
#include "support/fcl_mesh.h"
#include "support/oracle_rows.h"
#include "support/shared_data.h"
#include "timing.h"

#ifdef IST_HAVE_COAL
#include "coal_mesh.h"
#endif

namespace {

using ist::PlacedAsset;
using ist::Pose;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::benchmark::thread_seconds;

struct Body {
  ist::ClosedMesh closed;
  ist::Asset asset;
  std::map<double, ist::testing::FclMesh> fcl;  ///< by scale
#ifdef IST_HAVE_COAL
  std::map<double, ist::benchmark::CoalMesh> coal;
#endif

  Body(const ist::TriangleMesh& mesh, const std::string& name, std::size_t spheres)
      : closed(ist::close_mesh(mesh, name)), asset(ist::bake(closed, {.max_spheres = spheres})) {}
  const ist::testing::FclMesh& fcl_at(double scale) {
    return fcl.try_emplace(scale, closed.mesh, scale).first->second;
  }
};

struct Row {
  Pose pose;
  double scale = 1;
  double truth = NAN;  ///< [u] distance of the surfaces
};

/// Two bodies at many poses.
struct Scene {
  std::string name;
  Body *a, *b;
  std::vector<Row> rows;
};

/// Least time [µs] of a row over all rounds.
std::vector<double> times(const Scene& scene, int rounds,
                          const std::function<void(const Row&, std::size_t, int)>& ask) {
  static const double clock = ist::benchmark::clock_cost();
  std::vector<double> out(scene.rows.size(), HUGE_VAL);
  for (int round = 0; round < rounds; ++round)
    for (std::size_t i = 0; i < scene.rows.size(); ++i) {
      const double start = thread_seconds();
      ask(scene.rows[i], i, round);
      out[i] = std::min(out[i], 1e6 * std::max(1e-8, thread_seconds() - start - clock));
    }
  return out;
}

PlacedAsset at(Body& body, const Row& row) { return {body.asset.view(), row.pose, row.scale}; }

/// Ratios of two lists of times, row by row: median, that of nine rows in ten, the least.
std::array<double, 3> ratios(const std::vector<double>& slow, const std::vector<double>& fast) {
  std::vector<double> ratio;
  for (std::size_t i = 0; i < slow.size(); ++i) ratio.push_back(slow[i] / fast[i]);
  return {quantile(ratio, 0.5), quantile(ratio, 0.1), quantile(ratio, 0)};
}

/// How many times as long a peer takes in a scene: to be reached. 0: nothing is asked.
struct Aim {
  double median = 0, nine_of_ten = 0, p99 = 0;
};

void from_scratch(Report& report, const Scene& scene, const Aim& aim, int rounds) {
  ist::Workspace workspace;
  const std::size_t count = scene.rows.size();
  std::vector<double> fcl(count), coal(count, NAN);
  std::vector<ist::Separation> found(count);
  const PlacedAsset a{scene.a->asset.view(), {}};
  const auto ours = times(scene, rounds, [&](const Row& row, std::size_t i, int) {
    found[i] = ist::separation(a, at(*scene.b, row), {}, workspace);
  });
  const int peers = std::max(2, rounds / 3);
  for (const Row& row : scene.rows) scene.b->fcl_at(row.scale);
  const auto by_fcl = times(scene, peers, [&](const Row& row, std::size_t i, int) {
    fcl[i] =
        ist::testing::fcl_distance(scene.a->fcl_at(1), {}, scene.b->fcl_at(row.scale), row.pose);
  });
  double wrong = 0, visits = 0, tests = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double truth = std::isnan(scene.rows[i].truth) ? fcl[i] : scene.rows[i].truth;
    // What a solid holds has no distance.
    if (found[i].distance > 0) wrong = std::max(wrong, std::abs(found[i].distance - truth));
    visits += found[i].node_visits / double(count);
    tests += found[i].sphere_pairs / double(count);
  }
  const auto [median, tenth, least] = ratios(by_fcl, ours);
  Report::Json line = {{"scene", scene.name},
                       {"rows", count},
                       {"ist us, median", quantile(ours, 0.5)},
                       {"p99", quantile(ours, 0.99)},
                       {"FCL us, median", quantile(by_fcl, 0.5)},
                       {"FCL p99", quantile(by_fcl, 0.99)},
                       {"FCL over ist, median", median},
                       {"in nine rows of ten", tenth},
                       {"least", least},
                       {"visits a row", visits},
                       {"pairs a row", tests},
                       {"largest difference u", wrong}};
#ifdef IST_HAVE_COAL
  scene.a->coal.try_emplace(1.0, scene.a->closed.mesh);
  for (const Row& row : scene.rows)
    scene.b->coal.try_emplace(row.scale, scene.b->closed.mesh, row.scale);
  const auto by_coal = times(scene, peers, [&](const Row& row, std::size_t i, int) {
    coal[i] = ist::benchmark::CoalMesh::distance(scene.a->coal.at(1.0), scene.b->coal.at(row.scale),
                                                 row.pose);
  });
  line["Coal us, median"] = quantile(by_coal, 0.5);
  line["Coal over ist, median"] = ratios(by_coal, ours)[0];
#endif
  report.row("From scratch", line);
  const std::string what = scene.name + ": FCL over ist, ";
  if (aim.median > 0) report.target(what + "median of the rows", median, aim.median);
  if (aim.nine_of_ten > 0) report.target(what + "nine rows in ten", tenth, aim.nine_of_ten);
  if (aim.p99 > 0)
    report.target(what + "p99", quantile(by_fcl, 0.99) / quantile(ours, 0.99), aim.p99);
}

/// The same with a smaller B, or with both farther apart: as cheap.
void unlike(Report& report, const Scene& scene) {
  struct Change {
    const char* name;
    double size, distance;
  };
  for (const Change& change :
       {Change{"B a tenth", 0.1, 1}, Change{"B a hundredth", 0.01, 1},
        Change{"B a hundred-thousandth", 1e-5, 1}, Change{"a thousand times as far", 1, 1e3},
        Change{"a million times as far", 1, 1e6}}) {
    Scene changed{scene.name + ", " + change.name, scene.a, scene.b, {}};
    for (Row row : scene.rows) {
      row.scale *= change.size;
      row.truth = NAN;
      for (double& t : row.pose.t) t *= change.distance;
      changed.rows.push_back(row);
    }
    from_scratch(report, changed, {}, 3);
  }
}

/// Solids that cross: what the distance adds to the overlap.
void crossing(Report& report, const Scene& scene, int rounds) {
  ist::Workspace workspace;
  const PlacedAsset a{scene.a->asset.view(), {}};
  const auto gap = times(scene, rounds, [&](const Row& row, std::size_t, int) {
    ist::separation(a, at(*scene.b, row), {}, workspace);
  });
  std::vector<double> meeting;  // the rows whose inner spheres do
  for (std::size_t i = 0; i < gap.size(); ++i)
    if (ist::separation(a, at(*scene.b, scene.rows[i]), {.inner_spheres = true}, workspace)
            .distance_max == 0)
      meeting.push_back(gap[i]);
  Report::Json line = {{"scene", scene.name},
                       {"separation us, median", quantile(gap, 0.5)},
                       {"p99", quantile(gap, 0.99)},
                       {"rows", gap.size()},
                       {"inner spheres meet in", meeting.size()},
                       {"there separation us, median", quantile(meeting, 0.5)}};
  for (const auto& [name, measure] :
       {std::pair("matched", ist::Measure::matched), std::pair("inner", ist::Measure::inner),
        std::pair("exact", ist::Measure::exact)}) {
    ist::QuerySettings settings;
    settings.penetration.measure = measure;
    const auto volume = times(scene, rounds, [&](const Row& row, std::size_t, int) {
      ist::penetration(a, at(*scene.b, row), settings.penetration, workspace);
    });
    const auto both = times(scene, rounds, [&](const Row& row, std::size_t, int) {
      ist::query(a, at(*scene.b, row), settings, workspace);
    });
    const double ratio = ratios(both, volume)[0];
    line[std::string("query over penetration, ") + name + ", median"] = ratio;
    report.target(scene.name + ", " + name + ": query over penetration, median", ratio, 1.3, true);
  }
  report.row("Solids that cross", line);
  report.target(scene.name + ", inner spheres meet: separation us, median", quantile(meeting, 0.5),
                2, true);
}

/// Steps of one motion under a pair_id.
void in_a_loop(Report& report, const Scene& scene, int rounds) {
  ist::Workspace workspace;
  const PlacedAsset a{scene.a->asset.view(), {}};
  std::vector<ist::Separation> found(scene.rows.size()), kept(scene.rows.size());
  const auto scratch = times(scene, rounds, [&](const Row& row, std::size_t i, int) {
    found[i] = ist::separation(a, at(*scene.b, row), {}, workspace);
  });
  const auto steps = times(scene, rounds, [&](const Row& row, std::size_t i, int round) {
    kept[i] = ist::separation(a, at(*scene.b, row),
                              {.pair_id = static_cast<std::uint32_t>(round + 1)}, workspace);
  });
  double unlike = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    unlike += found[i].distance != kept[i].distance ||
              found[i].distance_min != kept[i].distance_min ||
              found[i].point_a != kept[i].point_a || found[i].point_b != kept[i].point_b;
  const double median = quantile(steps, 0.5) / quantile(scratch, 0.5),
               p99 = quantile(steps, 0.99) / quantile(scratch, 0.99);
  report.row("In a loop", {{"scene", scene.name},
                           {"steps", scene.rows.size()},
                           {"from scratch us, median", quantile(scratch, 0.5)},
                           {"from scratch p99", quantile(scratch, 0.99)},
                           {"kept us, median", quantile(steps, 0.5)},
                           {"kept p99", quantile(steps, 0.99)},
                           {"answers of other bits", unlike}});
  report.target(scene.name + ": kept over from scratch, median", median, 0.2, true);
  report.target(scene.name + ": kept over from scratch, p99", p99, 1.2, true);
  report.target(scene.name + ": answers of other bits", unlike, 0, true);
}

/// Farther than a part of the distance, and the yes and no of it.
void bounded(Report& report, const Scene& scene, int rounds) {
  ist::Workspace workspace;
  const PlacedAsset a{scene.a->asset.view(), {}};
  std::vector<double> distance;
  for (const Row& row : scene.rows)
    distance.push_back(ist::separation(a, at(*scene.b, row), {}, workspace).distance);
  Report::Json line = {{"scene", scene.name}};
  const auto spheres = times(scene, rounds, [&](const Row& row, std::size_t, int) {
    ist::overlap(a, at(*scene.b, row), workspace);
  });
  line["overlap us, median"] = quantile(spheres, 0.5);
  for (const double part : {0.5, 0.9, 1.1}) {
    const auto us = times(scene, rounds, [&](const Row& row, std::size_t i, int) {
      ist::separation(a, at(*scene.b, row), {.max_distance = part * distance[i]}, workspace);
    });
    const auto yes = times(scene, rounds, [&](const Row& row, std::size_t i, int) {
      ist::overlap(a, at(*scene.b, row), part * distance[i], workspace);
    });
    const std::string of = std::to_string(part).substr(0, 3) + " of the distance";
    line["max_distance " + of + " us"] = quantile(us, 0.5);
    line["margin " + of + " us"] = quantile(yes, 0.5);
  }
  report.row("Bounded", line);
}

/// Parts in place, and moved apart by almost nothing: as cheap.
void in_place(Report& report, const Scene& scene, int rounds) {
  ist::Workspace workspace;
  const PlacedAsset a{scene.a->asset.view(), {}};
  const auto us = times(scene, rounds, [&](const Row& row, std::size_t, int) {
    ist::separation(a, at(*scene.b, row), {}, workspace);
  });
  report.row("In place", {{"scene", scene.name},
                          {"in place us", us[0]},
                          {"1e-9 apart us", us[1]},
                          {"in place over apart", us[0] / us[1]}});
}

/// Where a nut turns on its bolt, above its place: it touches nothing.
std::vector<Row> in_clearance() {
  std::vector<Row> rows;
  for (int i = 0; i < 20; ++i) {
    const double turns = 0.125 + 0.05 * i, half = std::numbers::pi * turns;
    rows.push_back(
        {{{std::cos(half), 0, 0, std::sin(half)}, {0, 0, 8 + ist::kThreadPitch * turns}}});
  }
  return rows;
}

}  // namespace

int main(int argc, char** argv) {
  Report report("distance", argc, argv);
  report.page("Distances beside FCL and Coal");
  report.remark(
      "One thread, thread CPU time less the cost of the clock; every pose fresh (rounds over all "
      "rows in turn, least of the rounds a row). 4,000 spheres an object, of mated parts 1,000.");
  report.remark(
      "FCL 0.7 and Coal 3.0.3 (PyPI) measure OBBRSS models; ratios are those of each row. 'Pairs' "
      "of ist are triangles measured and spheres looked at.");
  const int rounds = report.quick() ? 3 : 9;
  std::map<std::string, std::unique_ptr<Body>> bodies;
  const auto body = [&](const std::string& path, std::size_t spheres) {
    auto& entry = bodies[path];
    if (!entry) entry = std::make_unique<Body>(ist::load_mesh(path), path, spheres);
    return entry.get();
  };
  const auto oracle = [&](const std::string& mesh) {
    return body(ist::testing::oracle_mesh_path(mesh), 4000);
  };

  std::vector<std::string> keys = {"eledino"};
  if (!report.quick()) keys = ist::testing::kPairKeys;
  for (const std::string& key : keys) {
    std::map<std::string, Scene> scenes;
    for (const auto& row : ist::testing::read_oracle_rows(key)) {
      Scene& scene = scenes[row.pose_class];
      scene.name = key + " " + row.pose_class;
      scene.a = oracle(row.mesh_a), scene.b = oracle(row.mesh_b);
      scene.rows.push_back({row.pose, row.scale_b, row.surface_distance});
    }
    from_scratch(report, scenes["sep"], {12, key == "big200k" ? 0. : 6, key == "big200k" ? 0. : 8},
                 rounds);
    bounded(report, scenes["sep"], rounds);
    if (key == "eledino") unlike(report, scenes["sep"]);
    for (const char* name : {"pen", "deep", "contain"}) crossing(report, scenes[name], rounds);
  }

  Scene apart{"traj apart", oracle("elephant"), oracle("dino"), {}};
  Scene away{"traj moved away by 0.02", oracle("elephant"), oracle("dino"), {}};
  {
    const std::string folder = ist::testing::shared_path("oracle/poses").string();
    const auto poses = ist::testing::read_csv(folder + "/traj_eledino.csv");
    const auto truths = ist::testing::read_csv(folder + "/truth_traj_eledino.csv");
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const auto number = [&](const char* column) { return std::stod(poses[i].at(column)); };
      Row row{{{number("qw"), number("qx"), number("qy"), number("qz")},
               {number("tx"), number("ty"), number("tz")}}};
      if (std::stod(truths[i].at("volume")) == 0) apart.rows.push_back(row);
      Eigen::Vector3d way(row.pose.t[0], row.pose.t[1], row.pose.t[2]);
      way *= 1 + 0.15 / way.norm();
      for (int k = 0; k < 3; ++k) row.pose.t[k] = way[k];
      away.rows.push_back(row);
    }
    away.name = "traj moved away by 0.15";
  }
  in_a_loop(report, apart, rounds);
  in_a_loop(report, away, rounds);

  const auto sample = [&](const char* name, const ist::TriangleMesh& mesh) {
    return (bodies[name] = std::make_unique<Body>(mesh, name, 4000)).get();
  };
  const Scene nut{"nut in clearance", sample("bolt", ist::make_sample("bolt")),
                  sample("nut", ist::make_sample("nut")), in_clearance()};
  from_scratch(report, nut, {80, 0, 0}, 3);

  std::ifstream file(ist::testing::shared_path("oracle/mated/rows.json"));
  const auto mates = nlohmann::json::parse(file);
  for (const auto& mate : mates) {
    const auto part = [&](int k) {
      return body(
          ist::testing::shared_path("oracle/mated/" + mate[k].get<std::string>() + ".off").string(),
          1000);
    };
    const auto moved = [&](const char* how, const std::vector<double>& by) {
      Scene scene{"mated " + mate[5].get<std::string>() + how, part(0), part(1), {}};
      for (const double u : by) {
        Row row;
        for (int k = 0; k < 4; ++k) row.pose.q[k] = mate[2][k];
        for (int k = 0; k < 3; ++k)
          row.pose.t[k] = mate[3][k].get<double>() - u * mate[4][k].get<double>();
        scene.rows.push_back(row);
      }
      return scene;
    };
    in_place(report, moved("", {0, 1e-9}), rounds);
    from_scratch(report, moved(", apart", {1e-3, 1e-2, 1e-1, 1, 10}), {}, 3);
    if (report.quick() && bodies.size() > 8) break;
  }
  return report.write();
}
