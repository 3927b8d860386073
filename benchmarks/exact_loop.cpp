// Exact queries as steps of a motion: what is kept from step to step (PenetrationSettings::pair_id)
// against the same queries from scratch. One thread; thread CPU time of each call; the least of a
// number of rounds over the whole motion, from scratch and kept in turn.
//
// Floor of a step: near pairs are tested by signs, eight at a time, some 12 ns each, and summed
// where they cross, some 100 ns for each crossing. A search from scratch adds boxes and planes: 100
// to 250 ns for each crossing, and all there is to do where nothing crosses.

#include <ist/bake.h>
#include <ist/query.h>

#include <cmath>
#include <numbers>

#include "mesh/samples/samples.h"
#include "report.h"
#include "support/oracle_rows.h"
#include "support/shared_data.h"
#include "timing.h"

namespace {

using ist::Asset;
using ist::Pose;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::benchmark::thread_seconds;

struct Motion {
  std::string name;
  const Asset *a, *b;
  std::vector<Pose> poses;
};

/// The nut down the bolt's thread at 1 kHz, `above` its place.
std::vector<Pose> threaded(double turns_a_second, double above) {
  std::vector<Pose> poses;
  for (int i = 0; i < 400; ++i) {
    const double turns = 0.125 + turns_a_second * i / 1000, half = std::numbers::pi * turns;
    poses.push_back(
        {{std::cos(half), 0, 0, std::sin(half)}, {0, 0, 8 + ist::kThreadPitch * (turns + above)}});
  }
  return poses;
}

void measure(Report& report, const Motion& motion) {
  ist::Workspace workspace;
  ist::PenetrationSettings settings;
  settings.measure = ist::Measure::exact;
  const std::size_t count = motion.poses.size();
  std::vector<double> scratch(count, HUGE_VAL), kept(count, HUGE_VAL);
  std::vector<bool> searched(count);
  double crossings = 0, unlike = 0;
  const std::uint32_t rounds = report.quick() ? 2 : 9;
  for (std::uint32_t round = 1; round <= rounds; ++round)
    for (std::size_t i = 0; i < count; ++i) {
      ist::Penetration found[2];
      for (const std::uint32_t id : {0u, round}) {
        settings.pair_id = id;
        const double start = thread_seconds();
        found[id == 0 ? 0 : 1] = ist::penetration(
            {motion.a->view(), {}, 1}, {motion.b->view(), motion.poses[i], 1}, settings, workspace);
        double& least = (id == 0 ? scratch : kept)[i];
        least = std::min(least, 1e6 * (thread_seconds() - start));
      }
      unlike += found[0].volume != found[1].volume || found[0].torque != found[1].torque;
      searched[i] = found[1].node_visits > 0;
      crossings += found[0].sphere_pairs;
    }
  std::vector<double> step, renewal;
  double sums[2] = {};
  for (std::size_t i = 0; i < count; ++i) {
    (searched[i] ? renewal : step).push_back(kept[i] / scratch[i]);
    sums[0] += scratch[i];
    sums[1] += kept[i];
  }
  const double clock = 1e6 * ist::benchmark::clock_cost();
  const auto us = [&](const std::vector<double>& of, double p) { return quantile(of, p) - clock; };
  report.row("Steps", {{"motion", motion.name},
                       {"steps", count},
                       {"crossing pairs", crossings / double(count) / rounds},
                       {"searched anew", double(renewal.size()) / double(count)},
                       {"from scratch: median, us", us(scratch, 0.5)},
                       {"p95 from scratch, us", us(scratch, 0.95)},
                       {"kept: median, us", us(kept, 0.5)},
                       {"p95 kept, us", us(kept, 0.95)},
                       {"p99 kept, us", us(kept, 0.99)},
                       {"mean, kept by scratch", sums[1] / sums[0]},
                       {"a kept step by scratch, median", quantile(step, 0.5)},
                       {"a search that keeps by scratch, median", quantile(renewal, 0.5)},
                       {"p95 of that", quantile(renewal, 0.95)}});
  report.target(motion.name + ": answers with other bits", unlike, 0, true);
  if (!renewal.empty() && !step.empty())
    report.target(motion.name + ": a search that keeps by one from scratch, median",
                  quantile(renewal, 0.5), 1.5, true);
}

}  // namespace

int main(int argc, char** argv) {
  Report report("exact_loop", argc, argv);
  const auto surface = [](ist::TriangleMesh mesh, const char* name) {
    return ist::bake_mesh_only(ist::close_mesh(std::move(mesh), name));
  };
  const auto oracle = [&](const char* name) {
    return surface(ist::load_mesh(ist::testing::oracle_mesh_path(name)), name);
  };
  const Asset elephant = oracle("elephant"), dino = oracle("dino");
  const Asset bolt = surface(ist::make_sample("bolt"), "bolt"),
              nut = surface(ist::make_sample("nut"), "nut");
  Motion trajectory{"eledino, trajectory", &elephant, &dino, {}};
  for (const auto& row :
       ist::testing::read_csv(ist::testing::shared_path("oracle/poses/traj_eledino.csv"))) {
    const auto number = [&](const char* name) { return std::stod(row.at(name)); };
    trajectory.poses.push_back({{number("qw"), number("qx"), number("qy"), number("qz")},
                                {number("tx"), number("ty"), number("tz")}});
  }
  measure(report, trajectory);
  for (const double speed : {0.1, 1.0}) {
    const std::string turns = speed < 1 ? ", 0.1 turns/s" : ", 1 turn/s";
    measure(report, {"nut on bolt, engaged" + turns, &bolt, &nut, threaded(speed, 0.25)});
    measure(report, {"nut on bolt, in clearance" + turns, &bolt, &nut, threaded(speed, 0)});
  }
  report.remark(
      "The trajectory moves by 0.4 mm and 0.02° of a metre a step. The nut turns along the thread "
      "at "
      "1 kHz, a quarter pitch too high or in its place. At a turn a second it moves too far for "
      "anything to be worth keeping.");
  return report.write();
}
