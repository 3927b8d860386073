// One knob for error: what PenetrationSettings::relative_error gives and takes, beside all spheres
// and the exact measure in the same run; and the errors of spheres that its predictions are fitted
// to. One thread; thread CPU time of each call less the cost of the clock; every pose fresh (rounds
// over all rows in turn, least of the rounds a row). IST_TRADE_ASSETS names a folder that keeps the
// assets, as for trade.

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <limits>

#include <ist/query.h>

#include "query/lod/wanted_error.h"
#include "report.h"
#include "support/turns.h"
#include "timing.h"
#include "trade_rows.h"

namespace {

using ist::benchmark::asset_of;
using ist::benchmark::PairOfBodies;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::benchmark::Row;

const auto& kClasses = ist::kOverlapClassNames;

/// What one setting makes of the rows of a pair.
struct Answers {
  std::vector<ist::Penetration> answers;
  std::vector<double> us;
};

Answers measure(const ist::Asset& a, const ist::Asset& b, const std::vector<Row>& rows,
                const ist::PenetrationSettings& settings, int rounds) {
  static const double clock = ist::benchmark::clock_cost();
  static ist::Workspace workspace;
  Answers result;
  result.answers.resize(rows.size());
  result.us.assign(rows.size(), std::numeric_limits<double>::infinity());
  for (int round = 0; round < rounds; ++round)
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double start = ist::benchmark::thread_seconds();
      result.answers[i] = ist::penetration(
          {a.view(), {}, 1}, {b.view(), rows[i].pose, rows[i].scale_b}, settings, workspace);
      const double seconds = ist::benchmark::thread_seconds() - start - clock;
      result.us[i] = std::min(result.us[i], 1e6 * std::max(0.0, seconds));
    }
  return result;
}

/// Rows of the answers under each setting; targets at the error that is aimed at.
void report_errors(Report& report, const PairOfBodies& pair, const ist::Asset& a,
                   const ist::Asset& b, int rounds) {
  const Answers exact = measure(a, b, pair.rows, {.measure = ist::Measure::exact}, rounds);
  std::vector<double> all_us;
  const auto add = [&](const std::string& setting, const Answers& got, double wanted) {
    for (std::size_t k = 0; k < kClasses.size(); ++k) {
      std::vector<double> error, angle, us;
      std::size_t exceeded = 0;
      for (std::size_t i = 0; i < pair.rows.size(); ++i) {
        if (pair.rows[i].overlap_class != k) continue;
        const ist::Penetration& answer = got.answers[i];
        error.push_back(100 * std::abs(answer.volume / pair.rows[i].volume - 1));
        angle.push_back(ist::testing::degrees_between(answer.force, exact.answers[i].force));
        us.push_back(got.us[i]);
        exceeded += answer.status != ist::QueryStatus::ok ? 1 : 0;
      }
      if (error.empty()) continue;
      Report::Json row = {{"pair", pair.key},
                          {"class", kClasses[k]},
                          {"setting", setting},
                          {"rows", error.size()},
                          {"error median %", quantile(error, 0.5)},
                          {"error p95 %", quantile(error, 0.95)},
                          {"median us", quantile(us, 0.5)},
                          {"p99 us", quantile(us, 0.99)},
                          {"exceeded", exceeded}};
      if (k > 0) {  // contained ones feel no force
        row["angle median °"] = quantile(angle, 0.5);
        row["angle p95 °"] = quantile(angle, 0.95);
      }
      report.row("Errors and times", row);
      if (wanted == 0) continue;
      const std::string of = ", " + pair.key + ", " + kClasses[k] + ", " + setting;
      report.target("error median %" + of, quantile(error, 0.5), 100 * wanted, true);
      report.target("error p95 %" + of, quantile(error, 0.95), 4 * 100 * wanted, true);
      if (pair.key != "eledino" || wanted != 0.005) continue;
      if (k > 0) report.target("force angle median °" + of, quantile(angle, 0.5), 1, true);
      report.target("median us" + of, quantile(us, 0.5), 20, true);
      report.target("p99 us" + of, quantile(us, 0.99), 100, true);
    }
  };
  add("all spheres", measure(a, b, pair.rows, {}, rounds), 0);
  add("exact", exact, 0);
  for (const double wanted : {0.005, 0.02, 0.05}) {
    const Answers got = measure(a, b, pair.rows, {.relative_error = wanted}, rounds);
    add(Report::Json(100 * wanted).dump() + " %", got, wanted);
  }
}

/// The errors that single levels have, over the number of solid spheres in the overlap.
void report_levels(Report& report, const PairOfBodies& pair, const std::vector<std::size_t>& counts,
                   bool keep) {
  std::array<std::vector<double>, 8> of_one;
  for (const std::size_t count : counts) {
    const ist::Asset a = asset_of(*pair.a, count, keep), b = asset_of(*pair.b, count, keep);
    const Answers got = measure(a, b, pair.rows, {.spheres_only = true}, 1);
    for (std::size_t i = 0; i < pair.rows.size(); ++i) {
      const auto spheres = [&](const ist::Asset& asset, double scale) {
        const ist::AssetHeader& header = asset.view().header();
        return pair.rows[i].volume /
               (std::ldexp(solid_volume(header, header.matched_tree), 3 * header.exponent) *
                (scale * scale * scale));
      };
      if (pair.rows[i].overlap_class == 0) continue;
      const double n_a = spheres(a, 1), n_b = spheres(b, pair.rows[i].scale_b);
      const double n = std::sqrt(2 / (1 / (n_a * n_a) + 1 / (n_b * n_b)));
      const double error = std::abs(got.answers[i].volume / pair.rows[i].volume - 1);
      const double bin = std::floor(2 * std::log10(n)) + 1;
      if (bin >= 0 && bin < static_cast<double>(of_one.size()))
        of_one[static_cast<std::size_t>(bin)].push_back(error * std::pow(n, 8.0 / 9));
    }
  }
  for (std::size_t bin = 0; bin < of_one.size(); ++bin) {
    if (of_one[bin].size() < 10) continue;
    report.row("Error times spheres in the overlap to the power of 8/9",
               {{"pair", pair.key},
                {"spheres from", std::pow(10, 0.5 * (static_cast<double>(bin) - 1))},
                {"rows", of_one[bin].size()},
                {"median", quantile(of_one[bin], 0.5)},
                {"p95", quantile(of_one[bin], 0.95)}});
  }
}

}  // namespace

int main(int argc, char** argv) {
  Report report("wanted_error", argc, argv);
  report.page("One knob for error");
  report.remark(
      "Medians over the rows of a class; one thread, thread CPU time less the cost of the clock; "
      "every pose fresh. Setting: relative_error, all spheres (the default), or Measure::exact. "
      "Exceeded: rows whose status is not ok.");
  report.remark(
      "eledino, big200k and ico1k are the oracle's rows with exact volumes; the others are random "
      "poses of development meshes.");
  if (!std::filesystem::exists(ist::testing::shared_path("oracle/poses/poses_eledino.csv"))) {
    std::cerr << "wanted_error: the oracle's rows are missing (IST_SHARED)\n";
    return 1;
  }
  const bool keep = !report.quick();
  const std::size_t spheres = report.quick() ? 2'000 : 30'000;
  const std::vector<std::size_t> counts =
      report.quick() ? std::vector<std::size_t>{500} : std::vector<std::size_t>{468, 1'875, 7'500};
  std::vector<PairOfBodies> pairs;
  pairs.push_back(ist::benchmark::oracle_pair("eledino"));
  if (!report.quick()) {
    for (const char* key : {"big200k", "ico1k"}) pairs.push_back(ist::benchmark::oracle_pair(key));
    for (const auto& [a, b] :
         {std::pair("bolt_gen.ply", "nut_gen.ply"), std::pair("spot.obj", "bunny_60k.ply"),
          std::pair("torus.off", "spot.obj"), std::pair("unit_cube.stl", "adis16480.stl")})
      pairs.push_back(ist::benchmark::development_pair(a, b, 30));
  }
  for (const PairOfBodies& pair : pairs) {
    report_errors(report, pair, asset_of(*pair.a, spheres, keep), asset_of(*pair.b, spheres, keep),
                  report.quick() ? 1 : 3);
    report_levels(report, pair, counts, keep);
  }
  return report.write();
}
