#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <ist/gpu_query.h>

#include "support/device_batch.h"
#include "support/separation_columns.h"

namespace ist::testing {

/// Device memory for separations.
class DeviceSeparations {
 public:
  explicit DeviceSeparations(std::size_t size)
      : distance_(size),
        distance_min_(size),
        distance_max_(size),
        point_a_(3 * size),
        point_b_(3 * size),
        normal_(3 * size),
        status_(size),
        visits_(size),
        spheres_(size) {}

  GpuSeparations answers() const {
    return {distance_.data(), distance_min_.data(), distance_max_.data(),
            point_a_.data(),  point_b_.data(),      normal_.data(),
            status_.data(),   visits_.data(),       spheres_.data()};
  }
  std::vector<Separation> get() const {
    return SeparationColumns{distance_.get(), distance_min_.get(), distance_max_.get(),
                             point_a_.get(),  point_b_.get(),      normal_.get(),
                             status_.get(),   visits_.get(),       spheres_.get()}
        .rows();
  }

 private:
  OnDevice<double> distance_, distance_min_, distance_max_, point_a_, point_b_, normal_;
  OnDevice<QueryStatus> status_;
  OnDevice<std::uint32_t> visits_, spheres_;
};

}  // namespace ist::testing
