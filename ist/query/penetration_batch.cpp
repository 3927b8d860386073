#include <ist/query.h>

#include "query/base/batch.h"

namespace ist {

void penetration_batch(std::span<const PlacedPair> pairs, const PenetrationSettings& settings,
                       std::span<Workspace> workspaces, std::span<Penetration> answers,
                       const ParallelFor& parallel) noexcept {
  answer_batch(pairs, settings, workspaces, answers, parallel);
}

void contact_patches_batch(std::span<const PlacedPair> pairs, const ContactSettings& settings,
                           std::span<Workspace> workspaces, std::span<ContactPatches> answers,
                           std::span<ContactPatch> patches, const ParallelFor& parallel) noexcept {
  patch_batch(pairs, settings, workspaces, answers, patches, parallel);
}

}  // namespace ist
