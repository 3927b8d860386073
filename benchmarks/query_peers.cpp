// Queries beside the peers on the oracle's rows: who answers what, how exactly, in what time.
// One thread; thread CPU time of each call; every pose fresh: a round goes over all rows of a pair
// key in turn, a row's time is its least of all rounds. Repeating one pose would train the branch
// predictor and flatter everybody.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>

#include <ist/bake.h>
#include <ist/query.h>

#include "report.h"
#include "sdf_voxel_sum.h"
#include "support/bullet_mesh.h"
#include "support/fcl_mesh.h"
#include "support/oracle_rows.h"
#include "support/turns.h"
#include "timing.h"

namespace {

using Eigen::Vector3d;
using ist::benchmark::clock_cost;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::benchmark::thread_seconds;
using ist::testing::degrees_between;
using ist::testing::OracleRow;

constexpr std::size_t kSpheres = 4000;
constexpr double kVoxel = 0.01;  ///< of the diameter, which is 1

/// The ways to ask for a volume: in full, and under pair budgets for deep and for shallow contacts.
struct Way {
  std::string name;
  std::uint32_t pair_budget;
};
const std::string kPlain = "ist penetration";
const std::vector<Way> kWays = {{kPlain, 0},
                                {kPlain + ", budget of 3,000 pairs", 3'000},
                                {kPlain + ", budget of 600 pairs", 600}};

const std::string kOverlap = "ist overlap", kFclOverlap = "FCL collide, yes or no";
const std::string kSdf = "SDF voxel sum, h = 0.01 D";
const std::string kListed = kSdf + ", voxels inside listed";

/// What a library says of one row; empty where it does not answer that question.
struct Answer {
  bool touching = false;
  std::optional<double> volume = {};
  Vector3d push_b = Vector3d::Zero();  ///< any length; zero if none
  std::optional<std::array<double, 2>> interval = {};
};

struct Query {
  std::string name;
  std::function<Answer(const OracleRow&)> ask;
  std::vector<Answer> answers = {};  ///< a row each
  std::vector<double> seconds = {};  ///< a row each, least of all rounds
};

/// The two meshes of a pair key as everybody sees them.
struct PairOfBodies {
  struct Body {
    explicit Body(const std::string& mesh_name, double small_scale)
        : closed(ist::close_mesh(ist::load_mesh(ist::testing::oracle_mesh_path(mesh_name)),
                                 mesh_name)),
          asset(ist::bake(closed, {.max_spheres = kSpheres})),
          fcl(closed.mesh),
          fcl_small(closed.mesh, small_scale),
          bullet(closed.mesh),
          bullet_small(closed.mesh, small_scale),
          voxels(*ist::make_solid(closed), kVoxel) {}
    ist::ClosedMesh closed;
    ist::Asset asset;
    ist::testing::FclMesh fcl, fcl_small;
    ist::testing::BulletMesh bullet, bullet_small;
    ist::benchmark::SdfVoxels voxels;
  };

  explicit PairOfBodies(const std::vector<OracleRow>& rows)
      : a(rows.front().mesh_a, rows.back().scale_b), b(rows.front().mesh_b, rows.back().scale_b) {}

  Body a, b;
  ist::Workspace workspace;
  ist::testing::BulletNarrowPhase bullet;
};

std::vector<Query> all_queries(PairOfBodies& pair) {
  const auto placed_b = [&pair](const OracleRow& row) {
    return ist::PlacedAsset{pair.b.asset.view(), row.pose, row.scale_b};
  };
  const auto fcl_b = [&pair](const OracleRow& row) -> const ist::testing::FclMesh& {
    return row.scale_b == 1 ? pair.b.fcl : pair.b.fcl_small;
  };
  const auto from_contacts = [](const ist::testing::MeshContacts& contacts) {
    return Answer{.touching = contacts.any(), .push_b = contacts.push_b};
  };
  const auto penetration = [&pair, placed_b](std::uint32_t budget) {
    return [&pair, placed_b, budget](const OracleRow& row) {
      const auto p = ist::penetration({pair.a.asset.view(), {}}, placed_b(row),
                                      {.pair_budget = budget}, pair.workspace);
      return Answer{p.volume > 0, p.volume, p.force, {}};
    };
  };
  std::vector<Query> queries;
  for (const Way& way : kWays) queries.push_back({way.name, penetration(way.pair_budget)});
  const std::vector<Query> others = {
      {"ist separation",
       [&pair, placed_b](const OracleRow& row) {
         const auto s =
             ist::separation({pair.a.asset.view(), {}}, placed_b(row), {}, pair.workspace);
         return Answer{.touching = s.distance == 0,
                       .interval = std::array{s.distance_min, s.distance_max}};
       }},
      {kOverlap,
       [&pair, placed_b](const OracleRow& row) {
         const auto answer = ist::overlap({pair.a.asset.view(), {}}, placed_b(row), pair.workspace);
         return Answer{.touching = answer == ist::YesNo::yes};
       }},
      {kFclOverlap,
       [&pair, fcl_b](const OracleRow& row) {
         return Answer{.touching =
                           ist::testing::fcl_in_contact(pair.a.fcl, {}, fcl_b(row), row.pose)};
       }},
      {"FCL collide, all contacts",
       [&pair, fcl_b, from_contacts](const OracleRow& row) {
         return from_contacts(ist::testing::fcl_contacts(pair.a.fcl, {}, fcl_b(row), row.pose));
       }},
      {"FCL distance",
       [&pair, fcl_b](const OracleRow& row) {
         const double d = ist::testing::fcl_distance(pair.a.fcl, {}, fcl_b(row), row.pose);
         return Answer{.touching = d == 0, .interval = std::array{d, d}};
       }},
      {"Bullet GImpact, all contacts",
       [&pair, from_contacts](const OracleRow& row) {
         auto& b = row.scale_b == 1 ? pair.b.bullet : pair.b.bullet_small;
         return from_contacts(pair.bullet.contacts(pair.a.bullet, {}, b, row.pose));
       }},
      {kSdf,
       [&pair](const OracleRow& row) {
         const double volume =
             pair.a.voxels.overlap_of_all(pair.b.voxels, ist::to_isometry(row.pose), row.scale_b);
         return Answer{.touching = volume > 0, .volume = volume};
       }},
      {kListed,
       [&pair](const OracleRow& row) {
         const double volume =
             pair.a.voxels.overlap(pair.b.voxels, ist::to_isometry(row.pose), row.scale_b);
         return Answer{.touching = volume > 0, .volume = volume};
       }},
  };
  queries.insert(queries.end(), others.begin(), others.end());
  return queries;
}

void measure(std::vector<Query>& queries, const std::vector<OracleRow>& rows, int rounds) {
  const double clock = clock_cost();
  for (Query& query : queries) {
    query.answers.resize(rows.size());
    query.seconds.assign(rows.size(), std::numeric_limits<double>::infinity());
    for (int round = 0; round < rounds; ++round) {
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const double start = thread_seconds();
        query.answers[i] = query.ask(rows[i]);
        const double seconds = std::max(0.0, thread_seconds() - start - clock);
        query.seconds[i] = std::min(query.seconds[i], seconds);
      }
    }
  }
}

/// Median and p99 [µs] of a class by query.
using Times = std::map<std::string, std::array<double, 2>>;

/// What is asked for: how many times as long a peer takes.
void aim(Report& report, const std::string& key, const std::string& pose_class, const Times& us) {
  struct Aim {
    std::string key, pose_class, peer;
    double median, p99;  ///< 0: nothing is asked
  };
  const std::string fcl = "FCL collide, all contacts", bullet = "Bullet GImpact, all contacts";
  for (const Aim& aim : std::initializer_list<Aim>{{"eledino", "pen", fcl, 25, 100},
                                                   {"eledino", "pen", kSdf, 150, 0},
                                                   {"eledino", "pen", kListed, 150, 0},
                                                   {"eledino", "deep", fcl, 50, 50},
                                                   {"eledino", "deep", bullet, 50, 50},
                                                   {"eledino", "contain", bullet, 15, 10},
                                                   {"big200k", "pen", fcl, 0, 500}}) {
    if (aim.key != key || aim.pose_class != pose_class) continue;
    for (const Way& way : kWays) {
      const std::string what =
          key + " " + pose_class + ": " + aim.peer + " over " + way.name + ", ";
      const auto& peers = us.at(aim.peer);
      const auto& ours = us.at(way.name);
      if (aim.median > 0) report.target(what + "median", peers[0] / ours[0], aim.median);
      if (aim.p99 > 0) report.target(what + "p99", peers[1] / ours[1], aim.p99);
    }
  }
  if (key == "eledino" && (pose_class == "pen" || pose_class == "deep"))
    report.target(key + " " + pose_class + ": " + kFclOverlap + " over " + kOverlap + ", median",
                  us.at(kFclOverlap)[0] / us.at(kOverlap)[0], 6);
  if (pose_class == "sep") {
    const auto& peers = us.at("FCL distance");
    const auto& ours = us.at("ist separation");
    report.target(key + " sep: FCL distance over ist separation, median", peers[0] / ours[0], 15);
    report.target(key + " sep: FCL distance over ist separation, p99", peers[1] / ours[1], 20);
  }
}

void report_times(Report& report, const std::string& key, const std::vector<Query>& queries,
                  const std::vector<OracleRow>& rows) {
  for (const std::string pose_class : {"sep", "pen", "deep", "contain"}) {
    Times us;
    for (const Query& query : queries) {
      std::vector<double> times;
      for (std::size_t i = 0; i < rows.size(); ++i) {
        if (rows[i].pose_class == pose_class) times.push_back(1e6 * query.seconds[i]);
      }
      us[query.name] = {quantile(times, 0.5), quantile(times, 0.99)};
    }
    for (const Query& query : queries) {
      const bool distance = query.name == "FCL distance" || query.name == "ist separation";
      const bool yes_or_no = query.name == kFclOverlap || query.name == kOverlap;
      const auto& ours = us[distance ? "ist separation" : yes_or_no ? kOverlap : kPlain];
      const auto& its = us[query.name];
      report.row("Time a query", {{"pair", key},
                                  {"class", pose_class},
                                  {"query", query.name},
                                  {"median us", its[0]},
                                  {"p99 us", its[1]},
                                  {"median, times ist", its[0] / ours[0]},
                                  {"p99, times ist", its[1] / ours[1]}});
    }
    aim(report, key, pose_class, us);
  }
}

/// Shares of the smaller solid that overlap, with the median error [%] that is asked for.
struct OverlapClass {
  std::string name;
  double least, most, error;
};
const std::vector<OverlapClass> kClasses = {
    {"1–10 %", 1e-2, 1e-1, 0.2}, {"0.1–1 %", 1e-3, 1e-2, 0.6}, {"0.01–0.1 %", 1e-4, 1e-3, 7}};

void report_answers(Report& report, const std::string& key, const std::vector<Query>& queries,
                    const std::vector<OracleRow>& rows) {
  for (const Query& query : queries) {
    std::size_t missed_contained = 0, contained = 0, missed_crossing = 0, false_touch = 0;
    std::size_t wrong_interval = 0;
    std::vector<double> error, deep_error, angle, width;
    std::vector<std::vector<double>> class_error(kClasses.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const OracleRow& row = rows[i];
      const Answer& answer = query.answers[i];
      const bool held = row.volume > 0 && row.surface_distance > 0;
      contained += held;
      missed_contained += held && !answer.touching;
      missed_crossing += row.surface_distance == 0 && !answer.touching;
      false_touch += row.volume == 0 && answer.touching;
      if (answer.volume && row.pose_class == "pen") {
        error.push_back(100 * std::abs(*answer.volume / row.volume - 1));
        for (std::size_t c = 0; c < kClasses.size(); ++c)
          if (row.fraction_of_smaller >= kClasses[c].least &&
              row.fraction_of_smaller < kClasses[c].most)
            class_error[c].push_back(error.back());
      }
      if (answer.volume && row.pose_class == "deep") {
        deep_error.push_back(100 * std::abs(*answer.volume / row.volume - 1));
      }
      if (answer.push_b.norm() > 0 && row.pose_class == "pen") {
        angle.push_back(degrees_between(answer.push_b, row.force));
      }
      if (answer.interval) {
        const auto [low, high] = *answer.interval;
        const double slack = 1e-9;  // the oracle's distances are rounded so
        wrong_interval += row.solid_distance() < low - slack || row.solid_distance() > high + slack;
        if (row.pose_class == "sep") width.push_back(high - low);
      }
    }
    Report::Json line = {
        {"pair", key},
        {"query", query.name},
        {"contained missed", std::to_string(missed_contained) + " of " + std::to_string(contained)},
        {"crossing missed", missed_crossing},
        {"contact at a gap", false_touch}};
    if (!error.empty()) {
      line["pen: volume error %, median"] = quantile(error, 0.5);
      line["p95"] = quantile(error, 0.95);
      for (std::size_t c = 0; c < kClasses.size(); ++c)
        if (!class_error[c].empty())
          line["error %, median, " + kClasses[c].name] = quantile(class_error[c], 0.5);
      line["deep: volume error %, median"] = quantile(deep_error, 0.5);
    }
    if (!angle.empty()) {
      line["pen: force angle, median"] = quantile(angle, 0.5);
      line["angle p95"] = quantile(angle, 0.95);
    }
    if (!width.empty()) {
      line["distance outside its interval"] = wrong_interval;
      line["sep: interval width / D, median"] = quantile(width, 0.5);
    }
    report.row("Right and wrong answers", line);

    if (query.name.starts_with(kPlain)) {
      report.target(key + ": contained rows missed, " + query.name, double(missed_contained), 0,
                    true);
      if (key == "eledino") {
        report.target("eledino deep: median volume error %, " + query.name,
                      quantile(deep_error, 0.5), 0.05, true);
        for (std::size_t c = 0; c < kClasses.size(); ++c)
          report.target(
              "eledino pen, " + kClasses[c].name + ": median volume error %, " + query.name,
              quantile(class_error[c], 0.5), kClasses[c].error, true);
      }
    }
    if (query.name == "ist separation") {
      report.target(key + ": distances outside the interval", double(wrong_interval), 0, true);
      if (key == "eledino") {
        report.target("eledino sep: median interval width / D", quantile(width, 0.5), 0.02, true);
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  Report report("query_peers", argc, argv);
  report.remark(
      "One thread, 4,000 spheres an object, thread CPU time less the cost of the clock; "
      "every pose fresh (rounds over all 200 rows in turn, least of the rounds a row).");
  report.remark(
      "FCL 0.7 (OBBRSS) and Bullet 3.24 (double precision, GImpact, margin 0) know "
      "surfaces only: they answer 'no contact' for an object held by another. 'Contact "
      "at a gap' of ist penetration is what the matched spheres protrude by; of Bullet, "
      "triangle pairs that cross each other's planes without touching.");
  report.remark(
      "The voxel sum samples both signed distances at every voxel of B's grid; 'voxels inside "
      "listed' "
      "at those inside of B alone, which are listed beforehand.");
  report.remark(
      "Times 'times ist' compare distances with ist separation, yes or no with ist overlap, the "
      "rest "
      "with ist penetration. 'Missed' of ist overlap is what it calls unknown: it is never wrong.");
  std::vector<std::string> keys = ist::testing::kPairKeys;
  if (report.quick()) keys = {"eledino"};
  for (const std::string& key : keys) {
    const auto rows = ist::testing::read_oracle_rows(key);
    PairOfBodies pair(rows);
    std::vector<Query> queries = all_queries(pair);
    measure(queries, rows, report.quick() ? 2 : 9);
    report_times(report, key, queries, rows);
    report_answers(report, key, queries, rows);
  }
  return report.write();
}
