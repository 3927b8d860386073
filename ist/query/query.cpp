#include <ist/query.h>

#include <ist/time_of_impact.h>
#include <cmath>
#include <utility>

#include "query/base/batch.h"
#include "query/base/no_answer.h"
#include "query/base/relative_pose.h"
#include "query/scratch/workspace.h"
#include "query/solid_queries.h"

// Every query of two solids: in their order, or swapped if the second is a shape.

namespace ist {
namespace {

/// Returns ask(a, b) of two assets, or of a shape and an asset. turn(answer) converts the answer if
/// the solids were swapped. Returns `none` for two shapes.
template <class Answer, class Ask, class Turn>
Answer ask_pair(const PlacedSolid& a, const PlacedSolid& b, Workspace& workspace,
                const Answer& none, const Ask& ask, const Turn& turn) noexcept {
  const WorkspaceInUse in_use(workspace);
  const auto* const tree_a = std::get_if<PlacedAsset>(&a.placed);
  const auto* const tree_b = std::get_if<PlacedAsset>(&b.placed);
  if (tree_b != nullptr)
    return tree_a != nullptr ? ask(*tree_a, *tree_b)
                             : ask(*std::get_if<PlacedShape>(&a.placed), *tree_b);
  if (tree_a == nullptr) return none;
  Answer answer = ask(*std::get_if<PlacedShape>(&b.placed), *tree_a);
  turn(answer);
  return answer;
}

bool are_known(const PenetrationSettings& settings) noexcept {
  return settings.measure <= Measure::exact && settings.relative_error >= 0;
}

const Pose& pose_of(const PlacedSolid& solid) noexcept {
  return std::visit([](const auto& placed) -> const Pose& { return placed.pose; }, solid.placed);
}

/// answers[i] = ask(pairs[i], workspace, i), or `unknown` without a workspace.
template <class Answer, class Ask>
void answer_each(std::span<const PlacedPair> pairs, std::span<Workspace> workspaces,
                 std::span<Answer> answers, const Answer& unknown, const ParallelFor& parallel,
                 const Ask& ask) noexcept {
  const std::size_t count = std::min(pairs.size(), answers.size());
  if (workspaces.empty()) {
    std::fill_n(answers.begin(), count, unknown);
    return;
  }
  answer_all(count, workspaces.size(), parallel, [&](std::size_t i, std::size_t worker) {
    answers[i] = ask(pairs[i], workspaces[worker], i);
  });
}

/// Swaps the witnesses of a separation or an impact.
template <class Answer>
void swap_witnesses(Answer& answer) noexcept {
  std::swap(answer.point_a, answer.point_b);
  answer.normal = -answer.normal;
}

}  // namespace

Penetration penetration(const PlacedSolid& a, const PlacedSolid& b,
                        const PenetrationSettings& settings, Workspace& workspace) noexcept {
  if (!are_known(settings)) return invalid_input<Penetration>();
  return ask_pair(
      a, b, workspace, missing_data<Penetration>(),
      [&](const auto& x, const PlacedAsset& y) {
        return find_penetration(x, y, settings, workspace);
      },
      [&](Penetration& answer) { turn_over(pose_of(a), pose_of(b), answer); });
}

Separation separation(const PlacedSolid& a, const PlacedSolid& b,
                      const SeparationSettings& settings, Workspace& workspace) noexcept {
  if (!(settings.max_distance >= 0)) return invalid_input<Separation>();
  return ask_pair(
      a, b, workspace, missing_data<Separation>(),
      [&](const auto& x, const PlacedAsset& y) {
        return find_separation(x, y, settings, workspace);
      },
      [](Separation& answer) { swap_witnesses(answer); });
}

PenetrationAndSeparation query(const PlacedSolid& a, const PlacedSolid& b,
                               const QuerySettings& settings, Workspace& workspace) noexcept {
  PenetrationAndSeparation both{penetration(a, b, settings.penetration, workspace), {}};
  // Without a gap there is nothing to search for. Matched spheres do not prove an overlap, but show
  // where inner spheres may.
  const Measure measure = settings.penetration.measure;
  const auto* const tree_a = std::get_if<PlacedAsset>(&a.placed);
  const auto* const tree_b = std::get_if<PlacedAsset>(&b.placed);
  const bool certified = both.penetration.status == QueryStatus::ok &&
                         both.penetration.volume_min > 0 &&
                         (measure == Measure::inner ||
                          (measure == Measure::exact && !settings.separation.inner_spheres) ||
                          (tree_a != nullptr && tree_b != nullptr &&
                           spheres_share(*tree_a, *tree_b, both.penetration)));
  if (!certified) both.separation = separation(a, b, settings.separation, workspace);
  return both;
}

ContactPatches contact_patches(const PlacedSolid& a, const PlacedSolid& b,
                               const ContactSettings& settings, Workspace& workspace,
                               std::span<ContactPatch> patches) noexcept {
  if (!are_known(settings) || patches.empty()) return invalid_input<ContactPatches>();
  return ask_pair(
      a, b, workspace, missing_data<ContactPatches>(),
      [&](const auto& x, const PlacedAsset& y) {
        return find_patches(x, y, settings, workspace, patches);
      },
      [&](ContactPatches& answer) {
        turn_over(pose_of(a), pose_of(b), answer.penetration);
        turn_over(pose_of(a), pose_of(b), patches.first(answer.count));
      });
}

YesNoAnswer overlap(const PlacedSolid& a, const PlacedSolid& b, Workspace& workspace) noexcept {
  const auto* const tree_a = std::get_if<PlacedAsset>(&a.placed);
  const auto* const tree_b = std::get_if<PlacedAsset>(&b.placed);
  if (tree_a != nullptr && tree_b != nullptr && lack_spheres(*tree_a, *tree_b))
    return overlap(a, b, 0, workspace);
  return ask_pair(
      a, b, workspace, YesNoAnswer{YesNo::unknown, QueryStatus::missing_data},
      [&](const auto& x, const PlacedAsset& y) { return find_overlap(x, y, workspace); },
      [](const YesNoAnswer&) {});
}

YesNoAnswer overlap(const PlacedSolid& a, const PlacedSolid& b, double margin,
                    Workspace& workspace) noexcept {
  if (!(margin >= 0)) return {YesNo::unknown, QueryStatus::invalid_input};
  const WorkspaceInUse in_use(workspace);
  const SeparationSettings settings{.max_distance = margin};
  const auto* const tree_a = std::get_if<PlacedAsset>(&a.placed);
  const auto* const tree_b = std::get_if<PlacedAsset>(&b.placed);
  const Separation gap = tree_a != nullptr && tree_b != nullptr
                             ? find_separation(*tree_a, *tree_b, settings, workspace, margin)
                             : separation(a, b, settings, workspace);
  if (std::isnan(gap.distance_max)) return {YesNo::unknown, gap.status};
  if (gap.distance_max <= margin) return {YesNo::yes, QueryStatus::ok};
  if (gap.distance_min > margin || std::isinf(gap.distance_max))
    return {YesNo::no, QueryStatus::ok};
  return {YesNo::unknown, gap.status};
}

TimeOfImpact time_of_impact(const PlacedSolid& a, const PlacedSolid& b, const Motions& motions,
                            const ImpactSettings& settings, Workspace& workspace) noexcept {
  if (!(settings.tolerance >= 0)) return invalid_input<TimeOfImpact>();
  const bool turned = std::holds_alternative<PlacedShape>(b.placed);
  const Motions ordered = turned ? Motions{motions.b, motions.a} : motions;
  return ask_pair(
      a, b, workspace, missing_data<TimeOfImpact>(),
      [&](const auto& x, const PlacedAsset& y) {
        return find_impact(x, y, ordered, settings, workspace);
      },
      [](TimeOfImpact& answer) { swap_witnesses(answer); });
}

void penetration_batch(std::span<const PlacedPair> pairs, const PenetrationSettings& settings,
                       std::span<Workspace> workspaces, std::span<Penetration> answers,
                       const ParallelFor& parallel) noexcept {
  answer_each(pairs, workspaces, answers, unknown_penetration(), parallel,
              [&](const PlacedPair& pair, Workspace& workspace, std::size_t) {
                return penetration(pair.a, pair.b, settings, workspace);
              });
}

void separation_batch(std::span<const PlacedPair> pairs, const SeparationSettings& settings,
                      std::span<Workspace> workspaces, std::span<Separation> answers,
                      const ParallelFor& parallel) noexcept {
  answer_each(pairs, workspaces, answers, unknown_separation(), parallel,
              [&](const PlacedPair& pair, Workspace& workspace, std::size_t) {
                return separation(pair.a, pair.b, settings, workspace);
              });
}

void contact_patches_batch(std::span<const PlacedPair> pairs, const ContactSettings& settings,
                           std::span<Workspace> workspaces, std::span<ContactPatches> answers,
                           std::span<ContactPatch> patches, const ParallelFor& parallel) noexcept {
  const std::size_t count = std::min(pairs.size(), answers.size());
  if (count == 0) return;
  const std::size_t each = patches.size() / count;
  answer_each(pairs, workspaces, answers, ContactPatches{unknown_penetration(), 0}, parallel,
              [&](const PlacedPair& pair, Workspace& workspace, std::size_t i) {
                return contact_patches(pair.a, pair.b, settings, workspace,
                                       patches.subspan(i * each, each));
              });
}

}  // namespace ist
