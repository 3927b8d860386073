#pragma once

#include <cstdint>
#include <vector>

#include "cuda/device_array.h"
#include "mesh/wide_tree.h"
#include "packing/backend/tasks.h"
#include "packing/calibrate/power_grid.h"

namespace ist::gpu {

/// A mesh cut into columns and the octree over them, in device memory
/// (packing/calibrate/column_lattice.h, packing/calibrate/host_calibration.h).
class ColumnsOnGpu {
 public:
  ColumnsOnGpu(Queue& queue, const WideTree& mesh, const ColumnPlan& plan);

  double length() const { return length_; }        ///< Σ of the spans' lengths, unit frame
  const PowerGrid& grid() const { return grid_; }  ///< its pointers are to device memory

 private:
  void cut(Queue& queue, const WideTree& mesh, const LineLattice& lines);
  void flag(Queue& queue);

  double length_ = 0;
  PowerGrid grid_;
  DeviceArray<std::uint32_t> first_;
  DeviceArray<ColumnSpan> spans_;
  std::vector<DeviceArray<std::uint32_t>> flags_;
};

}  // namespace ist::gpu
