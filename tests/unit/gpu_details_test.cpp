#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <string>

#include "base/team.h"
#include "cuda/query/detail_sums.h"
#include "query/base/relative_pose.h"
#include "query/kernel/node_kernel.h"
#include "support/detailed_pairs.h"
#include "support/host_batch.h"
#include "support/oracle_assets.h"

// The GPU's batch of trees at several levels of detail, its source run by teams of the host,
// against the CPU's query: under pair budgets, and of copies of one asset that all but coincide.

namespace ist::testing {
namespace {

Penetration by_cpu(const BatchPair& pair, std::uint32_t budget) {
  static Workspace workspace;
  PenetrationSettings settings;
  settings.spheres_only = true;
  settings.pair_budget = budget;
  return penetration(PlacedAsset{detailed_assets()[pair.a].view(), pair.pose_a, pair.scale_a},
                     PlacedAsset{detailed_assets()[pair.b].view(), pair.pose_b, pair.scale_b},
                     settings, workspace);
}

/// Largest differences to the CPU's answers, whose sums are in float.
struct Off {
  double volume = 0, push = 0, turn = 0, centre = 0;

  void look(const Penetration& gpu, const Penetration& cpu, double size) {
    ASSERT_EQ(gpu.status, cpu.status);
    const double scale = std::max(cpu.volume, 1e-5 * size * size * size);
    const double area = std::max(std::cbrt(scale * scale), cpu.force.norm());
    volume = std::max(volume, std::abs(gpu.volume - cpu.volume) / scale);
    push = std::max(push, (gpu.force - cpu.force).norm() / area);
    turn = std::max(turn, (gpu.torque - cpu.torque).norm() / (area * size));
    if (cpu.volume >= scale) centre = std::max(centre, (gpu.centroid - cpu.centroid).norm() / size);
  }
  void expect_small(const char* what) const {
    std::printf("%s: volume %.1e push %.1e turn %.1e centroid %.1e\n", what, volume, push, turn,
                centre);
    EXPECT_LE(volume, 1e-5) << what;
    EXPECT_LE(push, 1e-4) << what;
    EXPECT_LE(turn, 1e-4) << what;
    EXPECT_LE(centre, 1e-5) << what;
  }
};

TEST(GpuDetails, BudgetsAreTheCpus) {
  HostBatch batch(detailed_solids());
  const std::vector<BatchPair> pairs = detailed_pairs(150, 81);
  std::vector<Penetration> whole = batch.run(pairs, Measure::matched);
  std::size_t changed = 0;
  for (const std::uint32_t budget : {1u, 40u, 200u, 1000u, 5000u, 100000u}) {
    const std::vector<Penetration> answers = batch.run(pairs, Measure::matched, 0, budget);
    Off off;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      off.look(answers[i], by_cpu(pairs[i], budget), pairs[i].scale_b);
      changed += answers[i].volume != whole[i].volume ? 1 : 0;
    }
    off.expect_small(("budget " + std::to_string(budget)).c_str());
  }
  EXPECT_GT(changed, 200u);
  // The inner measure has no levels.
  expect_same_bits(batch.run(pairs, Measure::inner, 0, 40), batch.run(pairs, Measure::inner));
}

/// Determines a budget's shares, with the slopes for the gradients.
TEST(GpuDetails, QuickLooksAreTheCpus) {
  const HostSolids solids(detailed_solids());
  const auto memory = std::make_unique<gpu::FilledMemory>();
  std::size_t met = 0;
  for (const BatchPair& pair : detailed_pairs(200, 84)) {
    const gpu::SolidRef &a = solids.refs()[pair.a], &b = solids.refs()[pair.b];
    PairPlace place;
    ASSERT_TRUE(
        place.place(a.frame, pair.pose_a, pair.scale_a, b.frame, pair.pose_b, pair.scale_b));
    const SerialTeam team;
    gpu::QuickLooker looker(team, a.details, b.details, place.a_from_b, *memory);
    const gpu::QuickLook gpu = looker.look(true);
    const AssetHeader& header_a = detailed_assets()[pair.a].view().header();
    const AssetHeader& header_b = detailed_assets()[pair.b].view().header();
    const auto pose =
        relative_pose(PlacedAsset{detailed_assets()[pair.a].view(), pair.pose_a, pair.scale_a},
                      PlacedAsset{detailed_assets()[pair.b].view(), pair.pose_b, pair.scale_b});
    const QuickLook cpu = quick_look(
        SphereTree(header_a, matched_tree(header_a, header_a.detail_count)),
        SphereTree(header_b, matched_tree(header_b, header_b.detail_count)), pose->a_from_b, true);
    met += cpu.volume > 0 ? 1 : 0;
    // The CPU's balls have float positions.
    EXPECT_NEAR(gpu.volume, cpu.volume, 1e-5 * cpu.volume + 1e-6 * norm(cpu.slope.by_translation));
    const double slope = 1e-4 * (norm(cpu.slope.by_translation) + std::cbrt(cpu.volume) * 0.1);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(gpu.slope.by_translation[k], cpu.slope.by_translation[k], slope);
      EXPECT_NEAR(gpu.slope.by_rotation[k], cpu.slope.by_rotation[k], slope);
    }
  }
  EXPECT_GT(met, 80u);
}

TEST(GpuDetails, OracleRowsUnderABudgetAreTheCpus) {
  IST_NEEDS_SHARED("oracle/poses/poses_eledino.csv");
  constexpr std::size_t kSpheres = 1000;
  std::vector<GpuSolid> trees;
  std::map<std::string, std::uint32_t> known;
  const auto number_of = [&](const std::string& mesh) {
    const auto [at, fresh] = known.emplace(mesh, static_cast<std::uint32_t>(trees.size()));
    if (fresh) trees.push_back(oracle_asset(mesh, kSpheres).view());
    return at->second;
  };
  const std::vector<OracleRow> rows = read_oracle_rows("eledino");
  std::vector<BatchPair> pairs;
  for (const OracleRow& row : rows)
    pairs.push_back(
        {number_of(row.mesh_a), number_of(row.mesh_b), Pose{}, row.pose, 1, row.scale_b});
  HostBatch batch(trees);
  Workspace workspace;
  PenetrationSettings settings;
  settings.spheres_only = true;
  const std::vector<Penetration> whole = batch.run(pairs, Measure::matched);
  for (const std::uint32_t budget : {0u, 150u, 600u}) {
    settings.pair_budget = budget;
    const std::vector<Penetration> answers = batch.run(pairs, Measure::matched, 0, budget);
    std::size_t changed = 0;
    Off off;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto [a, b] = placed(rows[i], kSpheres);
      off.look(answers[i], penetration(a, b, settings, workspace),
               std::cbrt(b.asset.volume()) * b.scale);
      changed += answers[i].volume != whole[i].volume ? 1 : 0;
    }
    EXPECT_TRUE(budget == 0 ? changed == 0 : changed > 10) << changed;
    off.expect_small(("oracle rows, budget " + std::to_string(budget)).c_str());
  }
}

TEST(GpuDetails, CoincidentCopiesAreTheCpus) {
  HostBatch batch(detailed_solids());
  const std::vector<BatchPair> pairs = copies_in_place(120, 82);
  const std::vector<Penetration> whole = batch.run(pairs, Measure::matched);
  for (const std::uint32_t budget : {0u, 2000u}) {
    const std::vector<Penetration> answers = batch.run(pairs, Measure::matched, 0, budget);
    std::size_t changed = 0;
    EXPECT_GT(batch.counters.detailed, 40u);
    Off off;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      off.look(answers[i], by_cpu(pairs[i], budget), 0.9);
      changed += answers[i].volume != whole[i].volume ? 1 : 0;
    }
    EXPECT_TRUE(budget == 0 ? changed == 0 : changed > 20) << changed;
    off.expect_small(("copies, budget " + std::to_string(budget)).c_str());
  }
}

TEST(GpuDetails, LanesOfAWarpNeedNoLuck) {
  HostBatch batch(detailed_solids());
  std::vector<BatchPair> pairs = detailed_pairs(12, 83);
  pairs.push_back(pairs.front());
  pairs.back().b = pairs.back().a;
  pairs.back().pose_b = pairs.back().pose_a;
  pairs.back().scale_b = pairs.back().scale_a;
  const std::vector<Penetration> by_one = batch.run(pairs, Measure::matched, 0, 300);
  const std::vector<Penetration> by_warp = batch.run(pairs, Measure::matched, 1, 300);
  expect_same_bits(batch.run(pairs, Measure::matched, 2, 300), by_warp);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    EXPECT_NEAR(by_one[i].volume, by_warp[i].volume, 2e-6 * by_warp[i].volume);
    EXPECT_EQ(by_one[i].sphere_pairs, by_warp[i].sphere_pairs);
  }
}

}  // namespace
}  // namespace ist::testing
