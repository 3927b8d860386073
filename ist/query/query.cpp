#include <ist/query.h>

namespace ist {

PenetrationAndSeparation query(const PlacedTree& a, const PlacedTree& b,
                               const QuerySettings& settings, Workspace& workspace) noexcept {
  return {penetration(a, b, settings.penetration, workspace),
          separation(a, b, settings.separation, workspace)};
}

}  // namespace ist
