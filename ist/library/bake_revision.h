#pragma once

#include <cstdint>

namespace ist {

/// To be raised with every change by which some mesh and settings give other bytes than before:
/// entries that a cache holds from before are then passed over.
///
/// The tests hold the hash below against that of tests/soak/bake_hashes.csv, whose hashes of assets
/// change then too: whoever writes new ones there raises the one and copies the other.
inline constexpr std::uint32_t kBakeRevision = 9;
inline constexpr std::uint64_t kBakeHashesOfRevision = 1833951002004931908u;

}  // namespace ist
