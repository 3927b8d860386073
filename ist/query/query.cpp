#include <ist/query.h>

#include <ist/overlap.h>
#include <ist/time_of_impact.h>
#include <utility>

#include "query/base/batch.h"
#include "query/base/no_answer.h"
#include "query/base/turned_over.h"
#include "query/solid_queries.h"

// Every query of two solids: as they come, or turned over where the second is the field.

namespace ist {
namespace {

/// ask(a, b) of assets, or of a field and an asset. Its answer comes back by turn(answer), if the
/// order was the other one; two fields get `none`.
template <class Answer, class Ask, class Turn>
Answer ask_pair(const PlacedSolid& a, const PlacedSolid& b, const Answer& none, const Ask& ask,
                const Turn& turn) noexcept {
  const auto* const tree_a = std::get_if<PlacedTree>(&a.placed);
  const auto* const tree_b = std::get_if<PlacedTree>(&b.placed);
  if (tree_b != nullptr)
    return tree_a != nullptr ? ask(*tree_a, *tree_b)
                             : ask(*std::get_if<PlacedField>(&a.placed), *tree_b);
  if (tree_a == nullptr) return none;
  Answer answer = ask(*std::get_if<PlacedField>(&b.placed), *tree_a);
  turn(answer);
  return answer;
}

const Pose& pose_of(const PlacedSolid& solid) noexcept {
  return std::visit([](const auto& placed) -> const Pose& { return placed.pose; }, solid.placed);
}

/// Witnesses of a separation or an impact.
template <class Answer>
void turn_witnesses(Answer& answer) noexcept {
  std::swap(answer.point_a, answer.point_b);
  answer.normal = -answer.normal;
}

}  // namespace

Penetration penetration(const PlacedSolid& a, const PlacedSolid& b,
                        const PenetrationSettings& settings, Workspace& workspace) noexcept {
  return ask_pair(
      a, b, not_held<Penetration>(),
      [&](const auto& x, const PlacedTree& y) {
        return find_penetration(x, y, settings, workspace);
      },
      [&](Penetration& answer) { turn_over(pose_of(a), pose_of(b), answer); });
}

Separation separation(const PlacedSolid& a, const PlacedSolid& b,
                      const SeparationSettings& settings, Workspace& workspace) noexcept {
  return ask_pair(
      a, b, not_held<Separation>(),
      [&](const auto& x, const PlacedTree& y) {
        return find_separation(x, y, settings, workspace);
      },
      [](Separation& answer) { turn_witnesses(answer); });
}

PenetrationAndSeparation query(const PlacedSolid& a, const PlacedSolid& b,
                               const QuerySettings& settings, Workspace& workspace) noexcept {
  return {penetration(a, b, settings.penetration, workspace),
          separation(a, b, settings.separation, workspace)};
}

ContactPatches contact_patches(const PlacedSolid& a, const PlacedSolid& b,
                               const ContactSettings& settings, Workspace& workspace,
                               std::span<ContactPatch> patches) noexcept {
  return ask_pair(
      a, b, not_held<ContactPatches>(),
      [&](const auto& x, const PlacedTree& y) {
        return find_patches(x, y, settings, workspace, patches);
      },
      [&](ContactPatches& answer) {
        turn_over(pose_of(a), pose_of(b), answer.penetration);
        turn_over(pose_of(a), pose_of(b), patches.first(answer.count));
      });
}

Overlapping overlap(const PlacedSolid& a, const PlacedSolid& b, Workspace& workspace) noexcept {
  return ask_pair(
      a, b, Overlapping::unknown,
      [&](const auto& x, const PlacedTree& y) { return find_overlap(x, y, workspace); },
      [](Overlapping) {});
}

TimeOfImpact time_of_impact(const PlacedSolid& a, const PlacedSolid& b, const Motions& motions,
                            const ImpactSettings& settings, Workspace& workspace) noexcept {
  const bool turned = std::holds_alternative<PlacedField>(b.placed);
  const Motions ordered = turned ? Motions{motions.b, motions.a} : motions;
  return ask_pair(
      a, b, not_held<TimeOfImpact>(),
      [&](const auto& x, const PlacedTree& y) {
        return find_impact(x, y, ordered, settings, workspace);
      },
      [](TimeOfImpact& answer) { turn_witnesses(answer); });
}

void penetration_batch(std::span<const PlacedPair> pairs, const PenetrationSettings& settings,
                       std::span<Workspace> workspaces, std::span<Penetration> answers,
                       const ParallelFor& parallel) noexcept {
  const std::size_t count = std::min(pairs.size(), answers.size());
  if (workspaces.empty()) {
    std::fill_n(answers.begin(), count, unknown_penetration());
    return;
  }
  answer_all(count, workspaces.size(), parallel, [&](std::size_t i, std::size_t worker) {
    answers[i] = penetration(pairs[i].a, pairs[i].b, settings, workspaces[worker]);
  });
}

void contact_patches_batch(std::span<const PlacedPair> pairs, const ContactSettings& settings,
                           std::span<Workspace> workspaces, std::span<ContactPatches> answers,
                           std::span<ContactPatch> patches, const ParallelFor& parallel) noexcept {
  const std::size_t count = std::min(pairs.size(), answers.size());
  if (count == 0) return;
  if (workspaces.empty()) {
    std::fill_n(answers.begin(), count, ContactPatches{unknown_penetration(), 0});
    return;
  }
  const std::size_t each = patches.size() / count;
  answer_all(count, workspaces.size(), parallel, [&](std::size_t i, std::size_t worker) {
    answers[i] = contact_patches(pairs[i].a, pairs[i].b, settings, workspaces[worker],
                                 patches.subspan(i * each, each));
  });
}

}  // namespace ist
