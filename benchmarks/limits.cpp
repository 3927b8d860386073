// What limits do in a loop: a nut turns down a bolt under gravity at 1 kHz, without friction, under
// deadlines that bind and under pair budgets, and what becomes of its energy and of the time a
// tick.

#include <chrono>
#include <vector>

#include <ist/bake.h>

#include "report.h"
#include "samples/samples.h"
#include "support/nut_on_bolt.h"
#include "timing.h"

namespace {

using ist::benchmark::Report;

ist::Asset bake_sample(const char* name) {
  return ist::bake(ist::close_mesh(ist::make_sample(name), name), {.max_spheres = 4000});
}

struct Times {
  std::vector<double> us, unlimited_us;
  std::size_t cut = 0;
};

}  // namespace

int main(int argc, char** argv) {
  Report report("limits", argc, argv);
  report.remark(
      "A nut on a bolt, 4,000 spheres each, steel, free and without friction, 1 kHz: energy is "
      "what "
      "moves, what is lifted and stiffness × volume. Grown: the most that it rose over its start, "
      "over all that gravity set free. A deadline is of wall time: the machine should be idle, and "
      "the program run with real-time priority (chrt -f 50).");
  report.remark(
      "Ratio: time of a limited query over that of an unlimited one at the same pose, asked in "
      "turn; means over the run.");
  const ist::Asset bolt = bake_sample("bolt"), nut = bake_sample("nut");
  const ist::testing::MassProperties mass =
      ist::testing::mass_properties(ist::make_sample("nut"), ist::testing::kSteel);
  ist::Workspace workspace;
  const double seconds = report.quick() ? 0.1 : 1.5;
  for (const double stiffness : {3.0, 5.0}) {
    for (const ist::PenetrationSettings& settings : {ist::PenetrationSettings{},
                                                     {.deadline_us = 80},
                                                     {.deadline_us = 40},
                                                     {.deadline_us = 20},
                                                     {.pair_budget = 4000},
                                                     {.pair_budget = 700},
                                                     {.pair_budget = 400},
                                                     {.pair_budget = 200}}) {
      Times times;
      const auto timed = [&](const ist::Pose& pose, const ist::PenetrationSettings& how,
                             std::vector<double>& us) {
        const double start = ist::benchmark::wall_seconds();
        const ist::Penetration answer =
            ist::penetration({bolt.view(), {}, 1}, {nut.view(), pose, 1}, how, workspace);
        us.push_back(1e6 * (ist::benchmark::wall_seconds() - start));
        return answer;
      };
      const auto ask = [&](const ist::Pose& pose) {
        // In turn: who comes second finds the caches warm.
        const bool first = times.us.size() % 2 == 0;
        if (first) timed(pose, {}, times.unlimited_us);
        const ist::Penetration answer = timed(pose, settings, times.us);
        if (!first) timed(pose, {}, times.unlimited_us);
        times.cut += answer.status == ist::QueryStatus::ok ? 0 : 1;
        return answer;
      };
      const ist::Pose start{{1, 0, 0, 0}, {0, 0, ist::testing::kNutStart}};
      for (int i = 0; i < 100; ++i) ask(start);  // memory and caches come up
      times = {};
      const ist::testing::NutRun run = ist::testing::run_nut(mass, stiffness, 1000, seconds, ask);
      const auto p50 = [](const std::vector<double>& us) {
        return ist::benchmark::quantile(us, 0.5);
      };
      report.row("A nut on a bolt", {{"stiffness, mN/mm³", stiffness},
                                     {"deadline, µs", settings.deadline_us},
                                     {"pair budget", settings.pair_budget},
                                     {"travel, mm", run.travel},
                                     {"turns", -run.turns},
                                     {"energy grown", run.grown},
                                     {"energy lost", run.fell},
                                     {"µs a query, p50", p50(times.us)},
                                     {"p99", ist::benchmark::quantile(times.us, 0.99)},
                                     {"unlimited, p50", p50(times.unlimited_us)},
                                     {"cut short", static_cast<double>(times.cut) /
                                                       static_cast<double>(times.us.size())}});
      if (settings.deadline_us > 0)
        report.target("energy grown, stiffness " + std::to_string(stiffness) + ", deadline " +
                          std::to_string(settings.deadline_us),
                      run.grown, 0.02, true);
      if (settings.pair_budget > 0)
        report.target("time under a pair budget of " + std::to_string(settings.pair_budget) +
                          " over unlimited",
                      p50(times.us) / p50(times.unlimited_us), 1.05, true);
    }
  }
  return report.write();
}
