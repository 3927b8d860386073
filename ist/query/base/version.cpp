#include <ist/version.h>

namespace ist {

std::uint32_t version() noexcept { return IST_VERSION; }

bool serves(std::uint32_t headers) noexcept {
  constexpr std::uint32_t kCompatible = IST_VERSION_MAJOR > 0 ? 10000 : 100;
  return headers / kCompatible == IST_VERSION / kCompatible && headers <= IST_VERSION;
}

}  // namespace ist
