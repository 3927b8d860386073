#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/gpu.h>

#include "cuda/query/exact_arrays.h"

// Where contact patches by Measure::exact are worked out.

namespace ist::gpu {

/// A team's memory that is handed out piece by piece. All lanes ask alike.
struct PartRoom {
  std::byte* at;
  std::byte* end;

  /// Null where there is no more.
  template <class T>
  IST_HD T* take(std::size_t count) {
    constexpr std::size_t kAlign = 16;
    static_assert(alignof(T) <= kAlign);
    const std::size_t bytes = (count * sizeof(T) + kAlign - 1) / kAlign * kAlign;
    if (static_cast<std::size_t>(end - at) < bytes) return nullptr;
    T* const taken = reinterpret_cast<T*>(at);
    at += bytes;
    return taken;
  }
};

/// They are asked in the later passes of a batch of penetrations, from this on: teams search too.
constexpr int kFirstPatchPass = 1;
/// [bytes] of a team's room for crossings and parts.
IST_HD constexpr std::size_t patch_room(int pass) {
  return pass == kFirstPatchPass ? 256u << 10 : 16u << 20;
}

struct ExactPatchArrays : ExactArrays {
  GpuContactPatches patches;

  IST_HD std::size_t bytes_of_team(int pass) const {
    return ExactArrays::bytes_of_team(pass) + patch_room(pass) + 16 * std::size_t{most_blocks};
  }
  IST_HD std::byte* team(int pass, std::uint32_t n) const {
    return memory + n * bytes_of_team(pass);
  }
  IST_HD ExactRoom room(int pass, std::uint32_t n) const {
    return ExactRoom::at(team(pass, n), most_blocks, pass);
  }
  IST_HD PartRoom part_room(int pass, std::uint32_t n) const {
    return {team(pass, n) + ExactArrays::bytes_of_team(pass), team(pass, n + 1)};
  }
};

}  // namespace ist::gpu
