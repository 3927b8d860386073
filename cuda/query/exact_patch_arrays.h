#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/gpu.h>

#include "cuda/query/exact_arrays.h"

// The working memory of contact patches by Measure::exact.

namespace ist::gpu {

/// A team's memory that is handed out piece by piece. All lanes make the same calls.
struct Arena {
  std::byte* at;
  std::byte* end;

  /// Null if the rest is too small.
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

/// Teams also search, as in the later passes of penetrations.
constexpr int kFirstPatchPass = 0;
/// [bytes] of a team's memory for crossings and parts. A crossing takes about 1 KB.
IST_HD constexpr std::size_t patch_bytes(int pass) {
  return pass == 0 ? 384u << 10 : pass == 1 ? 2u << 20 : 16u << 20;
}

struct ExactPatchArrays : ExactArrays {
  GpuContactPatches patches;

  IST_HD std::size_t bytes_of_team(int pass) const {
    return searching(pass) + patch_bytes(pass) + 16 * std::size_t{most_blocks};
  }
  IST_HD std::byte* team(int pass, std::uint32_t n) const {
    return memory + n * bytes_of_team(pass);
  }
  IST_HD ExactWorkspace workspace(int pass, std::uint32_t n) const {
    return ExactWorkspace::at(team(pass, n), most_blocks, search_pass(pass));
  }
  IST_HD Arena arena(int pass, std::uint32_t n) const {
    return {team(pass, n) + searching(pass), team(pass, n + 1)};
  }

 private:
  /// The first two passes search in equal memory.
  IST_HD static int search_pass(int pass) { return pass == 0 ? 1 : pass; }
  IST_HD std::size_t searching(int pass) const {
    return ExactArrays::bytes_of_team(search_pass(pass));
  }
};

}  // namespace ist::gpu
