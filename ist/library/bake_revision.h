#pragma once

#include <cstdint>

namespace ist {

/// Raise it with every change by which some mesh and settings give other bytes than before: older
/// entries of a cache are then skipped.
/// The tests compare the hash below with that of tests/soak/bake_hashes.csv, whose hashes of assets
/// change then too: after writing new ones there, raise the one and copy the other.
inline constexpr std::uint32_t kBakeRevision = 9;
inline constexpr std::uint64_t kBakeHashesOfRevision = 1833951002004931908u;

}  // namespace ist
