// Times of impact beside FCL's continuous collision on the same motions, and beside plain
// conservative advancement on separation(). One thread; thread CPU time of each call; all ways go
// over all motions in turn, a motion's time is its least of all rounds.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <fcl/narrowphase/continuous_collision.h>

#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <ist/pose_eigen.h>
#include <ist/time_of_impact.h>

#include "report.h"
#include "support/fcl_mesh.h"
#include "support/oracle_rows.h"
#include "support/random_assets.h"
#include "timing.h"

namespace {

using Eigen::Vector3d;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::benchmark::thread_seconds;

constexpr double kTolerance = 1e-3;     ///< of B's bounding radius
constexpr int kSamples = 2000;          ///< of a motion, for the truth
constexpr std::size_t kFewMotions = 3;  ///< what takes long is asked of these
constexpr double kEnough = 1e-6;        ///< [T] where bisection ends

struct Body {
  Body(const std::string& path, std::size_t spheres)
      : closed(ist::close_mesh(ist::load_mesh(path), path)),
        asset(ist::bake(closed, {.max_spheres = spheres})),
        fcl(closed.mesh) {
    const ist::AssetHeader& header = asset.view().header();
    const ist::TreeHeader& tree = header.inner_tree;
    const double unit = std::ldexp(1, header.exponent);
    middle = Vector3d(header.centre) + unit * Vector3d(tree.root[0], tree.root[1], tree.root[2]);
    radius = unit * tree.root[3];
    reach = middle.norm() + unit * std::max(tree.root[3], tree.root_cover);
  }
  ist::ClosedMesh closed;
  ist::Asset asset;
  ist::testing::FclMesh fcl;
  Vector3d middle;
  double radius;
  double reach;  ///< from the mesh's origin, about which FCL turns it
};

/// B's way from pose to pose in [0, 1]; A stands at the origin.
struct Way {
  ist::Pose from, to;
  ist::Motion motion;
  bool hits = false;
  double time = 1;  ///< of the first contact, if it hits
};

ist::Pose pose_at(const Way& way, double time) { return ist::moved(way.from, way.motion, time); }

/// The first crossing of the surfaces that samples show, then by bisection.
void find_truth(const Body& a, const Body& b, Way& way) {
  const auto meet = [&](double time) {
    return ist::testing::fcl_in_contact(a.fcl, {}, b.fcl, pose_at(way, time));
  };
  for (int i = 0; i <= kSamples; ++i) {
    if (!meet(static_cast<double>(i) / kSamples)) continue;
    double low = std::max(0, i - 1) / static_cast<double>(kSamples);
    double high = static_cast<double>(i) / kSamples;
    while (high - low > kEnough) {
      const double middle = (low + high) / 2;
      (meet(middle) ? high : low) = middle;
    }
    way.hits = true;
    way.time = high;
    return;
  }
}

struct Kind {
  std::string name;
  double turn;   ///< [rad] at most
  double share;  ///< of the whole way, from shortly before the contact; 1: the whole
};

std::vector<Way> make_ways(const Body& a, const Body& b, const Kind& kind, int count) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Way> ways;
  while (static_cast<int>(ways.size()) < count) {
    const auto draw = [&] { return normal(random); };
    Way way;
    const double far = 1.05 * (a.radius + b.radius);
    const Vector3d from = ist::testing::random_vector(draw).normalized();
    const Vector3d aim = a.middle + 0.7 * a.radius * uniform(random) *
                                        ist::testing::random_vector(draw).normalized();
    way.from = ist::testing::random_pose(random, 0);
    const Eigen::Quaterniond start(ist::to_isometry(way.from).linear());
    const Eigen::Quaterniond end =
        Eigen::AngleAxisd(kind.turn * uniform(random),
                          ist::testing::random_vector(draw).normalized()) *
        start;
    const auto pose = [](const Eigen::Quaterniond& q, const Vector3d& t) {
      return ist::Pose{{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
    };
    way.from = pose(start, aim + far * from - start * b.middle);
    way.to = pose(end, aim - far * from - end * b.middle);
    way.motion = ist::motion_between(way.from, way.to, 1);
    if (kind.share < 1) {
      find_truth(a, b, way);
      if (!way.hits) continue;
      // A step that ends before the contact as often as after.
      const double begin = way.time - 2 * kind.share * (0.05 + 0.95 * uniform(random));
      const Way whole = way;
      way = Way{pose_at(whole, begin), pose_at(whole, begin + kind.share), {}};
      way.motion = ist::motion_between(way.from, way.to, 1);
    }
    find_truth(a, b, way);
    if (way.hits && way.time == 0) continue;
    ways.push_back(way);
  }
  return ways;
}

struct Answer {
  bool hit = false;
  bool unresolved = false;
  double time = 1;
  double steps = 0;
};

/// Steps of what separation() certifies, each as long as the fastest point of B needs for it.
Answer advance(const Body& a, const Body& b, const Way& way, double tolerance,
               ist::Workspace& workspace) {
  const double speed = way.motion.velocity.norm() + way.motion.angular_velocity.norm() * b.reach;
  Answer answer;
  for (double time = 0; time < 1;) {
    const ist::Separation gap =
        ist::separation(ist::PlacedAsset{a.asset.view(), {}, 1},
                        {b.asset.view(), pose_at(way, time), 1}, {}, workspace);
    ++answer.steps;
    if (gap.distance_min <= tolerance) {
      answer.hit = gap.distance_max <= 2 * tolerance;
      answer.unresolved = !answer.hit;
      answer.time = time;
      return answer;
    }
    time += (gap.distance_min - tolerance / 2) / speed;
  }
  return answer;
}

struct Library {
  std::string name;
  std::function<Answer(const Way&)> ask;
  std::size_t most = ~std::size_t{0};  ///< motions that it is asked of
  int rounds = 3;
  std::vector<Answer> answers = {};
  std::vector<double> seconds = {};
};

void run(Report& report, const std::string& pair, const Body& a, const Body& b, const Kind& kind,
         int count) {
  const std::vector<Way> ways = make_ways(a, b, kind, count);
  ist::Workspace workspace;
  const double tolerance = kTolerance * b.radius;
  const auto fcl_asks = [&](fcl::CCDSolverType solver, std::size_t most, double error) {
    return [&a, &b, solver, most, error](const Way& way) {
      const fcl::ContinuousCollisionRequestd request(most, error, fcl::CCDM_LINEAR, fcl::GST_LIBCCD,
                                                     solver);
      fcl::ContinuousCollisionResultd result;
      const fcl::Transform3d still = fcl::Transform3d::Identity();
      fcl::continuousCollide(a.fcl.model(), still, still, b.fcl.model(), ist::to_isometry(way.from),
                             ist::to_isometry(way.to), request, result);
      return Answer{result.is_collide, false, result.time_of_contact, 0};
    };
  };
  std::vector<Library> libraries;
  libraries.push_back({"ist", [&](const Way& way) {
                         ist::ImpactSettings settings;
                         settings.tolerance = tolerance;
                         const ist::TimeOfImpact found = ist::time_of_impact(
                             ist::PlacedAsset{a.asset.view(), {}, 1}, {b.asset.view(), way.from, 1},
                             {{}, way.motion}, settings, workspace);
                         return Answer{found.kind == ist::ImpactKind::impact,
                                       found.kind == ist::ImpactKind::unresolved, found.time,
                                       static_cast<double>(found.node_visits)};
                       }});
  libraries.push_back({"ist, steps of separation()",
                       [&](const Way& way) { return advance(a, b, way, tolerance, workspace); }});
  libraries.push_back({"FCL conservative advancement",
                       fcl_asks(fcl::CCDC_CONSERVATIVE_ADVANCEMENT, 10, 1e-4), kFewMotions, 1});
  libraries.push_back({"FCL samples, 100", fcl_asks(fcl::CCDC_NAIVE, 100, 1e-4)});

  for (Library& library : libraries) library.seconds.assign(ways.size(), 1e9);
  for (int round = 0; round < 3; ++round) {
    for (Library& library : libraries) {
      if (round >= library.rounds) continue;
      library.answers.clear();
      for (std::size_t i = 0; i < std::min(library.most, ways.size()); ++i) {
        const double start = thread_seconds();
        library.answers.push_back(library.ask(ways[i]));
        library.seconds[i] = std::min(library.seconds[i], thread_seconds() - start);
      }
    }
  }

  // [u] the way of the fastest point of B in the time between.
  const auto way_of = [&](const Way& way, double time) {
    return time * (way.motion.velocity.norm() + way.motion.angular_velocity.norm() * b.reach);
  };
  for (const Library& library : libraries) {
    int hits = 0, found = 0, missed = 0, false_alarms = 0, unresolved = 0, late = 0;
    std::vector<double> early, ratio, steps;
    for (std::size_t i = 0; i < library.answers.size(); ++i) {
      const Way& way = ways[i];
      const Answer& answer = library.answers[i];
      const bool stopped = answer.hit || answer.unresolved;
      hits += way.hits;
      unresolved += answer.unresolved;
      missed += way.hits && !stopped;
      found += way.hits && answer.hit;
      false_alarms += !way.hits && answer.hit;
      if (way.hits && stopped) {
        late += answer.time > way.time + kEnough;
        early.push_back(std::max(0.0, way_of(way, way.time - answer.time)) / (2 * b.radius));
      }
      ratio.push_back(library.seconds[i] / libraries[0].seconds[i]);
      steps.push_back(answer.steps);
    }
    Report::Json row = {{"pair", pair},
                        {"motion", kind.name},
                        {"asked", library.name},
                        {"motions", library.answers.size()},
                        {"hits", hits},
                        {"found", found},
                        {"unresolved", unresolved},
                        {"missed", missed},
                        {"too late", late},
                        {"hits where there are none", false_alarms},
                        {"early by, median % of B", 100 * quantile(early, 0.5)},
                        {"p95 %", 100 * quantile(early, 0.95)},
                        {"time / ist's, median", quantile(ratio, 0.5)},
                        {"p95", quantile(ratio, 0.95)},
                        {"visits or steps, median", quantile(steps, 0.5)}};
    report.row("Times of impact", row);
  }
  const auto median = [&](std::size_t which) { return quantile(libraries[which].seconds, 0.5); };
  std::fprintf(stderr, "%s %s: %.1f µs\n", pair.c_str(), kind.name.c_str(), 1e6 * median(0));
  int wrong = 0;
  for (std::size_t i = 0; i < ways.size(); ++i) {
    const Answer& answer = libraries[0].answers[i];
    wrong += ways[i].hits && answer.time > ways[i].time + kEnough;
    wrong += ways[i].hits && !answer.hit && !answer.unresolved;
  }
  report.target("wrong answers of ist, " + pair + ", " + kind.name, wrong, 0, true);
}

}  // namespace

int main(int argc, char** argv) {
  Report report("time_of_impact", argc, argv);
  report.page("Times of impact, beside FCL's continuous collision");
  const std::size_t spheres = 4'000;
  const int count = report.quick() ? 10 : 30;
  report.remark(
      "B comes from outside, goes through A's bounding ball and out again while it turns about its "
      "origin at constant speed (FCL's `InterpMotion`); a step is one of 2 % of that way, begun "
      "shortly before the contact. Assets of " +
      std::to_string(spheres) + " spheres with surfaces, tolerance 0.1 % of B's bounding radius.");
  report.remark(
      "Hits: FCL's surfaces cross at one of " + std::to_string(kSamples) +
      " times of the motion; the first contact by bisection between two of them. Early by: the way "
      "of B's fastest point between the time that is found and that of the contact, of B's "
      "bounding diameter. Too late: after that contact. Missed: the motion is said to be free.");
  report.remark(
      "Steps of separation(): plain conservative advancement on the certified distance, each step "
      "as long as the fastest point of B needs for it; unresolved where the cover balls of the "
      "inner spheres touch first.");
  report.remark(
      "FCL conservative advancement: `CCDC_CONSERVATIVE_ADVANCEMENT` on OBBRSS trees with its "
      "default error of 1e-4, on the first 3 motions, for it takes long; FCL samples: "
      "`CCDC_NAIVE` "
      "with 100 samples, a motion's first that meets is the time. One thread.");
  report.remark(
      "FCL 0.7.0's conservative advancement says of nearly every motion here that it is free, and "
      "of a "
      "small "
      "cube that goes straight through a large one too: a known fault of it with meshes "
      "(flexible-collision-library/fcl#120, #555), so its times tell little.");
  const std::vector<Kind> kinds = {
      {"straight", 0, 1}, {"turning up to 3 rad", 3, 1}, {"a step", 3, 0.02}};
  const auto dev = [](const char* name) {
    return ist::testing::shared_path(std::string("meshes/dev/") + name).string();
  };
  const auto oracle = [](const char* name) { return ist::testing::oracle_mesh_path(name); };
  const std::vector<std::array<std::string, 3>> pairs = {
      {"elephant, dino", oracle("elephant"), oracle("dino")},
      {"mug, spot", dev("mug.ply"), dev("spot.obj")},
      {"bolt, nut", dev("bolt_gen.ply"), dev("nut_gen.ply")}};
  for (const auto& [name, path_a, path_b] : pairs) {
    const Body a(path_a, spheres), b(path_b, spheres);
    for (const Kind& kind : kinds) run(report, name, a, b, kind, count);
    if (report.quick()) break;
  }
  return report.write();
}
