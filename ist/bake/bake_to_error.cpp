#include <ist/shapes.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <iterator>

#include "bake/asset/asset_writer.h"
#include "bake/backend/make_backend.h"
#include "bake/bake_solid.h"
#include "bake/count_search.h"
#include "bake/predict/partner_trials.h"
#include "bake/predict/trial_poses.h"
#include "base/stage.h"
#include "base/thread_arena.h"
#include "packing/base/packing_settings.h"

namespace ist {
namespace {

constexpr std::uint32_t kNearPoses = 40;      // at the requested overlap, for the search
constexpr std::uint32_t kPartnerPoses = 24;   // likewise, for each partner except the copy
constexpr std::uint32_t kFewTrials = 8;       // fewer are not significant
constexpr std::uint32_t kPosesPerClass = 30;  // more poses, for the prediction

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Progress, cancellation and the time limit of all stages of a search together.
class Watch {
 public:
  Watch(const ProgressCallback& progress, double time_limit)
      : progress_(progress), time_limit_(time_limit) {}

  /// The callback of a stage that only the caller may stop.
  ProgressCallback patient() {
    return [this](const Progress& now) {
      if (progress_ && !progress_(now)) cancelled_ = true;
      return !cancelled_;
    };
  }
  /// The callback of a stage that the time limit may stop as well.
  ProgressCallback strict() {
    return [this](const Progress& now) { return patient()(now) && !late(); };
  }

  double time_left() const {  ///< [s] 0: no limit
    return time_limit_ > 0 ? std::max(1e-3, time_limit_ - elapsed()) : 0;
  }
  bool late() {
    if (time_limit_ > 0 && elapsed() >= time_limit_) late_ = true;
    return late_;
  }
  bool is_late() const { return late_; }  ///< the time limit ended some stage
  void throw_if_cancelled() const {
    if (cancelled_) throw Error("bake to an error: cancelled");
  }

 private:
  using Clock = std::chrono::steady_clock;
  double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  const ProgressCallback& progress_;
  const double time_limit_;
  const Clock::time_point start_ = Clock::now();
  bool cancelled_ = false, late_ = false;
};

struct OtherTrial {
  TrialPartner partner;
  PartnerTrial trial;
};

struct Candidate {
  Asset asset;
  std::vector<double> errors = {};        ///< relative, of the volumes at the first poses of copies
  std::vector<double> other_errors = {};  ///< likewise at the first trials of other partners
  std::array<PartnerError, kTrialPartners> partners = {};  ///< near the requested overlap
  PartnerError worst = {};                                 ///< of `partners`
  std::uint32_t poses = 0;                                 ///< of all of them

  double error() const { return worst.median; }
  std::size_t spheres() const { return asset.view().sphere_count(); }
  StopReason packing_stop() const {
    return static_cast<StopReason>(asset.view().header().stop_reason);
  }
};

class TargetBake {
 public:
  TargetBake(ResolvedMesh resolved, const ErrorTarget& target, const PackingSettings& settings,
             const ProgressCallback& progress)
      : resolved_(std::move(resolved)),
        mesh_(resolved_.mesh),
        target_(target),
        settings_(settings),
        most_(settings.max_spheres == 0 ? kMostCounted : settings.max_spheres),
        watch_(progress, settings.time_limit),
        solid_(resolved_),
        kept_(solid_, resolved_.resolution, settings.keep_mesh, settings.threads),
        backend_(make_backend(solid_, settings.device, settings.gpu)) {}

  TargetedAsset run() {
    find_near_poses();
    if (!watch_.is_late()) find_other_trials();
    if (!poses_.empty() || !others_.empty()) {
      search();
      const bool did = does(*best_);
      if (add_other_poses() && judge(*best_) && did && !does(*best_)) search();
    }
    return result();
  }

 private:
  bool does(const Candidate& candidate) const {
    return candidate.poses > 0 && candidate.error() <= target_.relative_error;
  }

  /// Reports; false: the time limit is reached.
  bool go_on(Stage& stage, double part) {
    stage.stop([&](Progress& now) {
      now.spheres = best_ ? best_->spheres() : 0;
      now.fraction = part;
    });
    watch_.throw_if_cancelled();
    return !watch_.is_late();
  }

  /// Nothing: the time limit is reached. The first bake always completes, as there is no other
  /// result.
  std::optional<Asset> baked(std::size_t spheres) {
    PackingSettings of_size = settings_;
    of_size.max_spheres = spheres;
    of_size.time_limit = best_ ? 0 : watch_.time_left();
    try {
      return bake_solid(mesh_, solid_, kept_, *backend_, of_size,
                        best_ ? watch_.strict() : watch_.patient());
    } catch (const Error&) {
      watch_.throw_if_cancelled();
      if (watch_.is_late()) return std::nullopt;
      throw;
    }
  }

  /// The asset of the solid's own triangles, which gives exact volumes.
  AssetView own_mesh() {
    const AssetView baked = best_->asset.view();
    if (baked.mesh_state() == MeshState::unresolved)
      throw Error(mesh_.name +
                  ": the mesh counts volume twice, so that no error can be measured. " +
                  resolved_.resolution.reason + " Bake it to a number of spheres, or wrap it");
    if (baked.mesh_state() == MeshState::own || baked.mesh_state() == MeshState::resolved)
      return baked;
    if (!own_mesh_) own_mesh_ = bake_mesh_only(mesh_, settings_.threads);
    return own_mesh_->view();
  }

  /// Makes a first asset, and poses at the requested overlap.
  void find_near_poses() {
    std::optional<Asset> asset = baked(CountSearch::first(most_));
    if (!asset) return;
    best_ = Candidate{std::move(*asset)};
    const TrialBody body = {solid_, own_mesh()};
    Stage stage("predict", watch_.strict());
    poses_ = trial_poses_near(target_.at_overlap, body, body, kNearPoses, settings_.seed,
                              [&](double part) { return go_on(stage, part); });
  }

  void find_other_trials() {
    Stage stage("predict", watch_.strict());
    const PartnerTrials trials(solid_, own_mesh());
    double done = 0;
    for (const TrialPartner partner : kOtherPartners) {
      for (const PartnerTrial& trial : trials.find(
               partner, target_.at_overlap, kPartnerPoses, settings_.seed, [&](double part) {
                 return go_on(stage, (done + part) / std::size(kOtherPartners));
               }))
        others_.push_back({partner, trial});
      if (watch_.is_late()) return;
      ++done;
    }
  }

  /// Adds poses of all classes that the search has not used; false: the time limit is reached.
  bool add_other_poses() {
    const TrialBody body = {solid_, own_mesh()};
    Stage stage("predict", watch_.strict());
    const std::vector<TrialPose> others =
        trial_poses(body, body, kPosesPerClass, settings_.seed + 1,
                    [&](double part) { return go_on(stage, part); });
    if (watch_.is_late()) return false;
    first_of_classes_ = poses_.size();
    poses_.insert(poses_.end(), others.begin(), others.end());
    return true;
  }

  /// Evaluates a candidate at the poses where it has not been evaluated; false: the time limit is
  /// reached.
  bool judge(Candidate& candidate) {
    Stage stage("predict", watch_.strict());
    const AssetView& tree = candidate.asset.view();
    const std::size_t all = poses_.size() + others_.size();
    const auto next = [&] {
      const std::size_t done = candidate.errors.size() + candidate.other_errors.size();
      return go_on(stage, static_cast<double>(done) / static_cast<double>(all));
    };
    while (candidate.errors.size() < poses_.size()) {
      if (!next()) return false;
      const TrialPose& pose = poses_[candidate.errors.size()];
      const double volume = penetration({tree, {}, 1}, {tree, pose.b_in_a, pose.scale_b},
                                        {.spheres_only = true}, workspace_)
                                .volume;
      candidate.errors.push_back(std::abs(volume / pose.volume - 1));
    }
    while (candidate.other_errors.size() < others_.size()) {
      if (!next()) return false;
      const PartnerTrial& trial = others_[candidate.other_errors.size()].trial;
      const double volume = penetration(trial.partner, {tree, {}, 1}, {}, workspace_).volume;
      candidate.other_errors.push_back(std::abs(volume / trial.volume - 1));
    }
    sum_up(candidate);
    return true;
  }

  /// Medians of each partner near the requested overlap, and the worst of them.
  void sum_up(Candidate& candidate) const {
    candidate.poses = 0;
    candidate.worst = {};
    for (std::uint32_t k = 0; k < kTrialPartners; ++k) {
      const auto partner = static_cast<TrialPartner>(k);
      std::vector<double> errors;
      for (std::size_t i = 0; i < poses_.size() && partner == TrialPartner::copy; ++i)
        if (is_near(poses_[i], target_.at_overlap)) errors.push_back(candidate.errors[i]);
      for (std::size_t i = 0; i < others_.size(); ++i)
        if (others_[i].partner == partner) errors.push_back(candidate.other_errors[i]);
      const auto poses = static_cast<std::uint32_t>(errors.size());
      candidate.partners[k] = {partner, median(std::move(errors)), poses};
      if (poses < (partner == TrialPartner::copy ? 1 : kFewTrials)) continue;
      candidate.poses += poses;
      if (candidate.partners[k].median >= candidate.worst.median)
        candidate.worst = candidate.partners[k];
    }
  }

  /// If both meet the target, fewer spheres are better, else a smaller error.
  bool is_better(const Candidate& candidate, const Candidate& than) const {
    if (does(candidate) && does(than)) return candidate.spheres() < than.spheres();
    return candidate.error() < than.error();
  }

  /// Bakes until the count is found, a limit is reached, or the time is over. Starts from the best.
  void search() {
    CountSearch counts(target_.relative_error, most_);
    if (!judge(*best_)) return;
    double error = best_->error();
    std::size_t spheres = best_->spheres();
    StopReason stop = best_->packing_stop();
    for (;;) {
      // If a limit other than the count was reached, more spheres do not fit.
      if (stop != StopReason::sphere_count && error > target_.relative_error) return;
      const std::optional<std::size_t> next = counts.next(spheres, error);
      std::optional<Asset> asset = next ? baked(*next) : std::nullopt;
      if (!asset) return;
      Candidate candidate = {std::move(*asset)};
      if (!judge(candidate)) return;
      error = candidate.error();
      spheres = candidate.spheres();
      stop = candidate.packing_stop();
      if (is_better(candidate, *best_)) best_ = std::move(candidate);
    }
  }

  TargetedAsset result() const {
    const Candidate& best = *best_;
    const bool met = does(best);
    const StopReason stop = watch_.is_late() ? StopReason::time_limit
                            : met            ? StopReason::sphere_count
                                             : best.packing_stop();
    std::vector<std::byte> bytes(best.asset.bytes().begin(), best.asset.bytes().end());
    AssetHeader header = best.asset.view().header();
    header.asked_error = target_.relative_error;
    header.asked_at_overlap = target_.at_overlap;
    header.asked_spheres = settings_.max_spheres;
    header.measured_error = best.error();
    header.measured_poses = best.poses;
    header.worst_partner = static_cast<std::uint32_t>(best.worst.partner);
    header.search_stop = static_cast<std::uint32_t>(stop);
    if (first_of_classes_ && best.errors.size() == poses_.size()) {
      header.predicted_poses = static_cast<std::uint32_t>(poses_.size() - *first_of_classes_);
      for (std::uint32_t k = 0; k < kOverlapClasses; ++k) {
        std::vector<double> of_class;
        for (std::size_t i = *first_of_classes_; i < poses_.size(); ++i)
          if (poses_[i].overlap_class == k) of_class.push_back(best.errors[i]);
        header.predicted_error[k] = median(std::move(of_class));
      }
    }
    std::memcpy(bytes.data(), &header, sizeof(header));
    seal(bytes);
    return {Asset(bytes, mesh_.name), best.error(), best.poses, best.partners, met, stop};
  }

  const ResolvedMesh resolved_;
  const ClosedMesh& mesh_;
  const ErrorTarget target_;
  const PackingSettings settings_;
  const std::size_t most_;
  Watch watch_;
  const MeshSolid solid_;
  SharedMesh kept_;
  const std::unique_ptr<SolidBackend> backend_;
  std::vector<TrialPose> poses_;                 ///< near ones, then those of all classes
  std::optional<std::size_t> first_of_classes_;  ///< in `poses_`, once they are added
  std::vector<OtherTrial> others_;
  std::optional<Candidate> best_;
  std::optional<Asset> own_mesh_;  ///< if the best candidate has another mesh or none
  Workspace workspace_;
};

void check_target(const ErrorTarget& target) {
  if (!(target.relative_error > 0 && target.relative_error < 1))
    throw Error("the requested error must lie between 0 and 1");
  if (!(target.at_overlap >= 1e-4 && target.at_overlap <= 0.5))
    throw Error("the overlap of the requested error must lie between 0.01 % and 50 %");
}

}  // namespace

TargetedAsset bake_to_error(const ClosedMesh& mesh, const ErrorTarget& target,
                            const PackingSettings& settings, const ProgressCallback& progress) {
  check_target(target);
  PackingSettings largest = settings;
  if (largest.max_spheres == 0) largest.max_spheres = kMostCounted;
  packing::check_settings(largest);
  return thread_arena(settings.threads).execute([&] {
    return TargetBake(resolve(mesh, progress), target, settings, progress).run();
  });
}

}  // namespace ist
