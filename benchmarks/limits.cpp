// What limits do in a loop by the real clock: a nut turns down a bolt under gravity at 1 kHz, and a
// spring draws a ring along a torus knot at 2 kHz, both without friction. What becomes of the
// energy and of the time per query under deadlines and under fixed pair budgets?

#include <string>
#include <vector>

#include <ist/bake.h>
#include <ist/deadline.h>

#include "mesh/samples/samples.h"
#include "report.h"
#include "support/nut_on_bolt.h"
#include "support/ring_in_knot.h"
#include "timing.h"

namespace {

using ist::benchmark::quantile;
using ist::benchmark::Report;

ist::Asset bake_mesh(ist::TriangleMesh mesh, const char* name, std::size_t spheres) {
  return ist::bake(ist::close_mesh(std::move(mesh), name), {.max_spheres = spheres});
}

struct Limit {
  double deadline_us = 0;
  std::uint32_t pair_budget = 0;
};
constexpr Limit kLimits[] = {{}, {160}, {80}, {40}, {20}, {0, 4000}, {0, 700}, {0, 400}, {0, 200}};

/// A solid that moves against a fixed one, each tick's query timed with and without the limit.
class Loop {
 public:
  Loop(const ist::Asset& fixed, const ist::Asset& moving, const Limit& limit,
       const ist::Pose& start)
      : fixed_(fixed), moving_(moving), limit_(limit), deadline_(limit.deadline_us) {
    for (int i = 0; i < 100; ++i) ask(start);  // memory and caches come up
    us_.clear();
    unlimited_us_.clear();
    slow_ = 0;
    deadline_ = ist::Deadline(limit.deadline_us);
  }

  ist::Penetration ask(const ist::Pose& pose) {
    ist::PenetrationSettings settings{.pair_budget = limit_.pair_budget};
    deadline_.limit(settings);
    // In turn: the second one finds the caches warm.
    const bool first = us_.size() % 2 == 0;
    if (first) timed(pose, {}, unlimited_us_);
    const ist::Penetration answer = timed(pose, settings, us_);
    if (!first) timed(pose, {}, unlimited_us_);
    deadline_.record(answer, us_.back());
    slow_ += deadline_.too_slow() ? 1 : 0;
    budget_ = settings.pair_budget;
    return answer;
  }

  void report(Report& report, const std::string& loop, double stiffness, double grown,
              double lost) const {
    report.row(loop, {{"stiffness", stiffness},
                      {"deadline, µs", limit_.deadline_us},
                      {"pair budget", limit_.pair_budget},
                      {"energy grown", grown},
                      {"energy lost", lost},
                      {"µs a query, p50", quantile(us_, 0.5)},
                      {"p99", quantile(us_, 0.99)},
                      {"unlimited, p50", quantile(unlimited_us_, 0.5)},
                      {"unlimited, p99", quantile(unlimited_us_, 0.99)},
                      {"last budget", budget_},
                      {"too slow", static_cast<double>(slow_) / static_cast<double>(us_.size())}});
    const std::string what = loop + ", stiffness " + std::to_string(stiffness) + ", deadline " +
                             std::to_string(limit_.deadline_us);
    if (limit_.deadline_us > 0) {
      const bool skip = 8 * slow_ > us_.size();
      report.target("energy grown: " + what, skip ? 0 : grown, 0.01, true);
      report.target("p99 over the deadline: " + what,
                    skip ? 0 : quantile(us_, 0.99) / limit_.deadline_us, 1.2, true);
    }
    if (limit_.pair_budget > 0)
      report.target(loop + ": time under a pair budget of " + std::to_string(limit_.pair_budget) +
                        " over unlimited",
                    quantile(us_, 0.5) / quantile(unlimited_us_, 0.5), 1.05, true);
  }

 private:
  ist::Penetration timed(const ist::Pose& pose, const ist::PenetrationSettings& how,
                         std::vector<double>& us) {
    const double start = ist::benchmark::wall_seconds();
    const ist::Penetration answer =
        ist::penetration({fixed_.view(), {}, 1}, {moving_.view(), pose, 1}, how, workspace_);
    us.push_back(1e6 * (ist::benchmark::wall_seconds() - start));
    return answer;
  }

  const ist::Asset& fixed_;
  const ist::Asset& moving_;
  const Limit limit_;
  ist::Deadline deadline_;
  ist::Workspace workspace_;
  std::vector<double> us_, unlimited_us_;
  std::size_t slow_ = 0;
  std::uint32_t budget_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  Report report("limits", argc, argv);
  report.remark(
      "A nut on a bolt, 4,000 spheres each, steel, free and without friction, 1 kHz: energy is "
      "what moves, what is lifted and stiffness (mN/mm³) × volume. Grown: the most that it rose "
      "over its start, over all that gravity set free.");
  report.remark(
      "A ring on a torus knot, 16,000 spheres each, drawn by a spring, 2 kHz: potential ½ × "
      "stiffness × volume². Grown: the most that energy rose over its start, at ticks without "
      "contact.");
  report.remark(
      "Deadlines are wall time, kept by ist::Deadline: the machine should be idle, and the program "
      "run with real-time priority (chrt -f 50). The unlimited query is asked in turn at the same "
      "pose.");
  const bool quick = report.quick();
  {
    const ist::Asset bolt = bake_mesh(ist::make_sample("bolt"), "bolt", 4000);
    const ist::Asset nut = bake_mesh(ist::make_sample("nut"), "nut", 4000);
    const ist::testing::MassProperties mass =
        ist::testing::mass_properties(ist::make_sample("nut"), ist::testing::kSteel);
    for (const double stiffness : {3.0, 5.0}) {
      for (const Limit& limit : kLimits) {
        Loop loop(bolt, nut, limit, {{1, 0, 0, 0}, {0, 0, ist::testing::kNutStart}});
        const ist::testing::NutRun run =
            ist::testing::run_nut(mass, stiffness, 1000, quick ? 0.1 : 1.5,
                                  [&](const ist::Pose& pose) { return loop.ask(pose); });
        loop.report(report, "A nut on a bolt", stiffness, run.grown, run.fell);
      }
    }
  }
  const std::size_t spheres = quick ? 4000 : 16000;
  const ist::Asset knot = bake_mesh(ist::make_sample("torus_knot"), "knot", spheres);
  const ist::Asset ring = bake_mesh(ist::testing::ring_mesh(), "ring", spheres);
  for (const double stiffness : {1e4, 1e5}) {
    for (const Limit& limit : kLimits) {
      Loop loop(knot, ring, limit, {{1, 0, 0, 0}, {3, 0, 0}});
      const ist::testing::RingRun run = ist::testing::run_ring(
          stiffness, 2000, quick ? 0.5 : 4, [&](const ist::Pose& pose) { return loop.ask(pose); });
      loop.report(report, "A ring on a torus knot", stiffness, run.grown, run.fell);
    }
  }
  return report.write();
}
