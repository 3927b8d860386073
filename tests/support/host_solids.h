#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <list>
#include <memory>
#include <span>
#include <vector>

#include <ist/gpu_query.h>

#include "cuda/query/batch_arrays.h"
#include "cuda/query/make_solid_ref.h"

namespace ist::testing {

/// Copies of solids as a batch of the GPU's finds them, in the host's memory.
class HostSolids {
 public:
  HostSolids(const std::vector<GpuSolid>& solids) {
    for (std::size_t i = 0; i < solids.size(); ++i)
      refs_.push_back(
          gpu::solid_ref(solids, i, [this](const auto& array) { return kept(std::span(array)); }));
  }
  HostSolids(std::initializer_list<GpuSolid> solids) : HostSolids(std::vector<GpuSolid>(solids)) {}

  const std::vector<gpu::SolidRef>& refs() const { return refs_; }
  std::uint32_t most_bins() const {
    std::uint32_t most = 0;
    for (const gpu::SolidRef& solid : refs_)
      for (const gpu::CutsRef& cuts : solid.cuts) most = std::max(most, cuts.bins);
    return most;
  }
  std::size_t bytes() const { return bytes_; }

  gpu::SolidPairs asked(const GpuPairs& pairs, Measure measure,
                        const GpuPenetrations& answers) const {
    return {refs_.data(), static_cast<std::uint32_t>(refs_.size()), measure, pairs, answers};
  }

 private:
  struct alignas(64) Line {
    std::byte bytes[64];
  };

  template <class T>
  const T* kept(std::span<const T> from) {
    const std::span<const std::byte> bytes = std::as_bytes(from);
    std::vector<Line>& to = memory_->emplace_back(bytes.size() / sizeof(Line) + 1);
    std::copy(bytes.begin(), bytes.end(), reinterpret_cast<std::byte*>(to.data()));
    bytes_ += bytes.size();
    return reinterpret_cast<const T*>(to.data());
  }

  std::shared_ptr<std::list<std::vector<Line>>> memory_ =
      std::make_shared<std::list<std::vector<Line>>>();
  std::vector<gpu::SolidRef> refs_;
  std::size_t bytes_ = 0;
};

}  // namespace ist::testing
