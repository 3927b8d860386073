#include <ist/query.h>

#include "query/base/batch.h"

namespace ist {

void penetration_batch(std::span<const PlacedPair> pairs, const PenetrationSettings& settings,
                       std::span<Workspace> workspaces, std::span<Penetration> answers,
                       const ParallelFor& parallel) noexcept {
  answer_batch(pairs, settings, workspaces, answers, parallel);
}

}  // namespace ist
