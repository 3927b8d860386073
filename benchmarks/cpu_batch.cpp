// How penetration_batch() scales with threads, and whether the order of pairs of many assets
// matters. Ratios alone count: each is of rounds in turn.

#include <ist/asset_layout.h>
#include <ist/query.h>
#include <ist/query_tbb.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <barrier>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "mesh/samples/samples.h"
#include "report.h"
#include "support/oracle_assets.h"
#include "timing.h"

namespace {

using ist::benchmark::quantile;
using ist::benchmark::Report;

/// Answers pairs on so many threads of TBB; [s].
class Asker {
 public:
  explicit Asker(std::size_t threads) : arena_(static_cast<int>(threads)) {
    for (std::size_t i = 0; i < threads; ++i) workspaces_.emplace_back();
  }

  double time(std::span<const ist::PlacedPair> pairs) {
    answers_.resize(pairs.size());
    const double start = ist::benchmark::wall_seconds();
    arena_.execute(
        [&] { penetration_batch(pairs, {}, workspaces_, answers_, ist::tbb_parallel_for()); });
    return ist::benchmark::wall_seconds() - start;
  }

 private:
  tbb::task_arena arena_;
  std::vector<ist::Workspace> workspaces_;
  std::vector<ist::Penetration> answers_;
};

const ist::AssetView& tree_of(const ist::PlacedSolid& solid) {
  return std::get<ist::PlacedAsset>(solid.placed).asset;
}
ist::AssetView& tree_of(ist::PlacedSolid& solid) {
  return std::get<ist::PlacedAsset>(solid.placed).asset;
}

/// How many times as much so many threads do as one where they share nothing: each asks all pairs
/// by penetration(), of copies of its own. What the machine has for them.
double ceiling(std::span<const ist::PlacedPair> pairs, std::size_t threads) {
  struct Alone {
    Alone(const ist::AssetView& first, const ist::AssetView& second)
        : a(bytes_of(first), "copy"), b(bytes_of(second), "copy") {}
    static std::span<const std::byte> bytes_of(const ist::AssetView& tree) {
      return {reinterpret_cast<const std::byte*>(&tree.header()), tree.header().file_bytes};
    }
    ist::Asset a, b;
    std::vector<ist::PlacedPair> pairs;
    ist::Workspace workspace;
    double seconds = 0;
  };
  std::vector<std::unique_ptr<Alone>> all;
  for (std::size_t i = 0; i < threads; ++i) {
    auto one = std::make_unique<Alone>(tree_of(pairs[0].a), tree_of(pairs[0].b));
    one->pairs.assign(pairs.begin(), pairs.end());
    for (ist::PlacedPair& pair : one->pairs) {
      // Rows have both solids either way round.
      const bool as_first = &tree_of(pair.a).header() == &tree_of(pairs[0].a).header();
      tree_of(pair.a) = as_first ? one->a.view() : one->b.view();
      tree_of(pair.b) = as_first ? one->b.view() : one->a.view();
    }
    all.push_back(std::move(one));
  }
  const auto ask = [](Alone& one) {
    const double start = ist::benchmark::wall_seconds();
    for (const ist::PlacedPair& pair : one.pairs) penetration(pair.a, pair.b, {}, one.workspace);
    one.seconds = ist::benchmark::wall_seconds() - start;
  };
  ask(*all[0]);
  ask(*all[0]);
  const double alone = all[0]->seconds;
  std::vector<std::thread> running;
  std::barrier warm(static_cast<std::ptrdiff_t>(threads));
  for (const auto& one : all)
    running.emplace_back([&] {
      ask(*one);
      warm.arrive_and_wait();
      ask(*one);
    });
  for (std::thread& thread : running) thread.join();
  double longest = 0;
  for (const auto& one : all) longest = std::max(longest, one->seconds);
  return static_cast<double>(threads) * alone / longest;
}

/// Pairs of many assets, each with copies of bytes of its own, in random order.
std::vector<ist::PlacedPair> many_assets(std::vector<ist::Asset>& assets, std::size_t count) {
  std::mt19937_64 random(1);
  std::vector<ist::PlacedPair> pairs;
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < count; ++i) {
    const ist::Asset& a = assets[random() % assets.size()];
    const ist::Asset& b = assets[random() % assets.size()];
    ist::Pose pose;
    double length = 0;
    for (double& q : pose.q) q = normal(random), length += q * q;
    for (double& q : pose.q) q /= std::sqrt(length);
    pose.t[0] = 2;
    pairs.push_back({{a.view(), {}, 1}, {b.view(), pose, 1}});
  }
  return pairs;
}

std::tuple<const void*, const void*> names(const ist::PlacedPair& pair) {
  return {&tree_of(pair.a).header(), &tree_of(pair.b).header()};
}

}  // namespace

int main(int argc, char** argv) {
  Report report("cpu_batch", argc, argv);
  const std::size_t cores = std::thread::hardware_concurrency();
  const std::size_t spheres = report.quick() ? 1000 : 4000;
  const int rounds = report.quick() ? 5 : 9;
  report.remark(
      "Elephant and dino, 4,000 spheres each, rows of the oracle in turn. Speed-up: the time of "
      "one thread over that of n, the median of rounds in turn; share: of n. Ceiling: how many "
      "times "
      "as much n threads do as one where they share nothing at all, the median of rounds likewise: "
      "two threads of one core have less than two cores.");

  std::vector<std::size_t> counts;
  for (std::size_t n = 1; n < cores; n *= 2) counts.push_back(n);
  counts.push_back(cores);
  for (const std::string name : {"sep", "pen", "deep", "contain"}) {
    std::vector<ist::PlacedPair> rows, pairs;
    for (const ist::testing::OracleRow& row : ist::testing::read_oracle_rows("eledino")) {
      if (row.pose_class != name) continue;
      const auto [a, b] = ist::testing::placed(row, spheres);
      rows.push_back({a, b});
    }
    const std::size_t count = name == "sep" ? 100'000 : 4000;
    for (std::size_t i = 0; i < count; ++i) pairs.push_back(rows[i % rows.size()]);
    Asker one(1);
    const double alone = one.time(pairs);
    for (const std::size_t threads : counts) {
      Asker many(threads);
      many.time(pairs);
      std::vector<double> ups, most;
      for (int round = 0; round < rounds; ++round) {
        const double before = one.time(pairs), at_once = many.time(pairs), after = one.time(pairs);
        ups.push_back(0.5 * (before + after) / at_once);
        if (round % 3 == 0) most.push_back(ceiling(pairs, threads));
      }
      report.row("Speed-up by threads",
                 {{"class", name},
                  {"pairs", count},
                  {"µs a pair, one thread", 1e6 * alone / static_cast<double>(count)},
                  {"threads", threads},
                  {"speed-up", quantile(ups, 0.5)},
                  {"share", quantile(ups, 0.5) / static_cast<double>(threads)},
                  {"ceiling", quantile(most, 0.5)}});
      if (threads != cores || threads == 1) continue;
      report.target("speed-up over threads, " + name,
                    quantile(ups, 0.5) / static_cast<double>(threads), 0.9);
      report.target("speed-up over ceiling, " + name, quantile(ups, 0.5) / quantile(most, 0.5),
                    0.9);
    }
  }

  report.remark(
      "Order: torus knots of 4,000 spheres, as many copies in memory as said, pairs drawn at "
      "random; the same pairs sorted by their assets' addresses. The time of sorting is left out.");
  const ist::Asset knot = ist::bake(ist::close_mesh(ist::make_sample("torus_knot"), "torus_knot"),
                                    {.max_spheres = spheres});
  for (const std::size_t copies : {4u, 64u, 1024u}) {
    std::vector<ist::Asset> assets;
    for (std::size_t i = 0; i < copies; ++i) assets.emplace_back(knot.bytes(), "copy");
    const std::vector<ist::PlacedPair> shuffled = many_assets(assets, 4000);
    std::vector<ist::PlacedPair> sorted = shuffled;
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const auto& one, const auto& other) { return names(one) < names(other); });
    Asker asker(cores);
    asker.time(shuffled);
    std::vector<double> ratios, us;
    for (int round = 0; round < rounds; ++round) {
      const double before = asker.time(shuffled), in_order = asker.time(sorted),
                   after = asker.time(shuffled);
      us.push_back(1e6 * 0.5 * (before + after) / 4000);
      ratios.push_back(in_order / (0.5 * (before + after)));
    }
    report.row("Sorted by asset", {{"assets", copies},
                                   {"MB", static_cast<double>(copies * knot.bytes().size()) / 1e6},
                                   {"µs a pair, shuffled", quantile(us, 0.5)},
                                   {"sorted / shuffled", quantile(ratios, 0.5)}});
  }
  return report.write();
}
