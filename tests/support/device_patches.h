#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <ist/gpu_query.h>

#include "support/device_batch.h"
#include "support/patch_columns.h"

namespace ist::testing {

/// Device memory for the patches of pairs.
class DevicePatches {
 public:
  DevicePatches(std::size_t pairs, std::uint32_t most)
      : most_(most),
        count_(pairs),
        id_(pairs * most),
        centroid_(3 * pairs * most),
        normal_(3 * pairs * most),
        area_(pairs * most),
        depth_(pairs * most),
        volume_(pairs * most),
        force_(3 * pairs * most),
        torque_(3 * pairs * most),
        point_(3 * pairs * most),
        twist_(pairs * most) {}

  GpuContactPatches patches() const {
    return {most_,          count_.data(),  id_.data(),    centroid_.data(),
            normal_.data(), area_.data(),   depth_.data(), volume_.data(),
            force_.data(),  torque_.data(), point_.data(), twist_.data()};
  }
  std::vector<PatchedPair> get(const std::vector<Penetration>& wholes) const {
    return PatchColumns{most_,         count_.get(),  id_.get(),    centroid_.get(),
                        normal_.get(), area_.get(),   depth_.get(), volume_.get(),
                        force_.get(),  torque_.get(), point_.get(), twist_.get()}
        .rows(wholes);
  }

 private:
  std::uint32_t most_;
  OnDevice<std::uint32_t> count_;
  OnDevice<std::uint64_t> id_;
  OnDevice<double> centroid_, normal_, area_, depth_, volume_, force_, torque_, point_, twist_;
};

}  // namespace ist::testing
