#pragma once

#include <ist/types.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "cuda/base/device_array.h"
#include "cuda/base/queue.h"
#include "mesh/hierarchy/wide_tree.h"
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

/// The cover radii before rounding to float, bit for bit those of the host. `report(depth)` is
/// called before each level.
std::vector<double> cover_radii(Queue& queue, const WideTree& mesh, const CoverTask& task,
                                const std::function<void(int)>& report);

/// The largest protrusion of the balls from the solid, at least 0; unit frame, as on the host.
double largest_protrusion(Queue& queue, const WideTree& mesh, std::span<const Sphere> balls);

/// Relaxes sites within a solid's columns, bit for bit as on the host. `report(part)` receives the
/// completed part, [0, 1]. Returns none if the columns cannot measure the solid.
RelaxedSites relax_sites(Queue& queue, const WideTree& mesh, const RelaxTask& task,
                         const std::function<void(double)>& report);

}  // namespace ist::gpu
