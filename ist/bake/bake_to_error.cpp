#include <ist/bake.h>
#include <ist/error.h>
#include <ist/query.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "asset/asset_writer.h"
#include "bake/predict/trial_poses.h"
#include "mesh/mesh_solid.h"
#include "stage/thread_arena.h"

namespace ist {
namespace {

constexpr std::uint32_t kPosesPerClass = 50;
constexpr double kTruthShare = 0.1;           // of the target: what the truth may be off
constexpr double kTruthBest = 1e-4;           // no truth is asked to be better than this
constexpr double kNear = 3.1622776601683795;  // overlaps within this factor of the one asked about
constexpr std::size_t kFirst = 1'000;         // spheres: the first guess
constexpr std::size_t kFewest = 16;
constexpr std::size_t kMost = 200'000;  // where the caller sets no limit
constexpr double kCloseEnough = 1.25;   // between a count that does and one that does not
constexpr int kMostBakes = 10;

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Relative errors of an asset's volumes at the poses.
std::vector<double> errors_at(const TreeView& tree, const std::vector<TrialPose>& poses) {
  Workspace workspace;
  std::vector<double> errors;
  for (const TrialPose& pose : poses) {
    const double volume =
        penetration({tree, {}, 1}, {tree, pose.b_in_a, pose.scale_b}, {}, workspace).volume;
    errors.push_back(std::abs(volume / pose.volume - 1));
  }
  return errors;
}

/// What is asked and what is known to answer it.
struct Trials {
  ErrorTarget target;
  std::vector<TrialPose> poses;

  /// Median error near the overlap that was asked about.
  double error_of(const Asset& asset) const {
    const std::vector<double> errors = errors_at(asset.view(), poses);
    std::vector<double> near;
    for (std::size_t i = 0; i < poses.size(); ++i)
      if (poses[i].overlap_class != 0 && poses[i].fraction >= target.at_overlap / kNear &&
          poses[i].fraction <= target.at_overlap * kNear)
        near.push_back(errors[i]);
    return median(near);
  }

  /// The asset with the predicted errors in its header.
  Asset with_prediction(const Asset& asset, std::size_t asked_spheres,
                        const std::string& name) const {
    std::vector<std::byte> bytes(asset.bytes().begin(), asset.bytes().end());
    AssetHeader header = asset.view().header();
    const std::vector<double> errors = errors_at(asset.view(), poses);
    for (std::uint32_t k = 0; k < kOverlapClasses; ++k) {
      std::vector<double> of_class;
      for (std::size_t i = 0; i < poses.size(); ++i)
        if (poses[i].overlap_class == k) of_class.push_back(errors[i]);
      header.predicted_error[k] = median(std::move(of_class));
    }
    header.predicted_poses = static_cast<std::uint32_t>(poses.size());
    header.asked_error = target.relative_error;
    header.asked_at_overlap = target.at_overlap;
    header.asked_spheres = asked_spheres;
    std::memcpy(bytes.data(), &header, sizeof(header));
    seal(bytes);
    return Asset(bytes, name);
  }
};

void check_target(const ErrorTarget& target) {
  if (!(target.relative_error > 0 && target.relative_error < 1))
    throw Error("the error asked for must lie between 0 and 1");
  if (!(target.at_overlap >= 1e-4 && target.at_overlap <= 0.5))
    throw Error("the overlap at which an error is asked for must lie between 0.01 % and 50 %");
}

}  // namespace

Asset bake_to_error(const ClosedMesh& mesh, const ErrorTarget& target,
                    const PackingSettings& settings, const ProgressCallback& progress) {
  check_target(target);
  const std::size_t most = settings.max_spheres == 0 ? kMost : settings.max_spheres;
  const auto bake_of = [&](std::size_t spheres) {
    PackingSettings of_size = settings;
    of_size.max_spheres = spheres;
    return bake(mesh, of_size, progress);
  };

  std::size_t count = std::min(kFirst, most);
  Asset asset = bake_of(count);
  Trials trials{target, {}};
  const MeshSolid solid(mesh);
  thread_arena(settings.threads).execute([&] {
    trials.poses =
        trial_poses({solid, asset.view()}, {solid, asset.view()}, kPosesPerClass,
                    std::max(kTruthBest, kTruthShare * target.relative_error), settings.seed);
  });

  // Between a count that fails and one that does, the next is guessed: error falls as 1 / count.
  std::size_t fails = 0, does = 0;
  std::optional<Asset> best;
  for (int bakes = 1;; ++bakes) {
    const double error = trials.error_of(asset);
    const AssetHeader& header = asset.view().header();
    const bool cancelled = header.stop_reason == static_cast<std::uint32_t>(StopReason::cancelled);
    const std::size_t packed = header.sphere_count;
    const bool enough = error <= target.relative_error;
    (enough ? does : fails) = count;
    // Another limit than the count ended it, or there is no room for more.
    const bool last = cancelled || packed < count || count >= most;
    if (enough || (does == 0 && last)) best = std::move(asset);
    if (cancelled || (does == 0 && last)) break;
    const double ratio = static_cast<double>(does) / static_cast<double>(std::max(fails, kFewest));
    if (bakes >= kMostBakes && best) break;
    if (does > 0 && (ratio <= kCloseEnough || does <= kFewest)) break;
    const double guess =
        static_cast<double>(count) * std::clamp(1.1 * error / target.relative_error, 0.1, 8.0);
    const double low = 1.15 * static_cast<double>(std::max(fails, kFewest));
    const double high = does > 0 ? static_cast<double>(does) / 1.15 : static_cast<double>(most);
    count = std::clamp(static_cast<std::size_t>(std::clamp(guess, low, std::max(low, high))),
                       kFewest, most);
    asset = bake_of(count);
  }
  return trials.with_prediction(*best, settings.max_spheres, mesh.name);
}

}  // namespace ist
