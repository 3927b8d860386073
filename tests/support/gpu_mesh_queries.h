#pragma once

#include <cstdint>

#include "cuda/base/device_array.h"
#include "mesh/hierarchy/wide_searches.h"

// Many questions to a mesh at once, a warp each. All arrays are in device memory; answers come in
// the order of the questions.

namespace ist::gpu {

struct NearestQuestion {
  float p[3];    ///< unit frame
  float limit2;  ///< nothing beyond this squared distance is of interest
};

struct ExactQuestion {
  double p[3];   ///< unit frame
  double limit;  ///< nothing at this distance or beyond is of interest
};

struct LineQuestion {
  double y, z;  ///< unit frame; the line is parallel to x
};

struct LineCrossings {
  static constexpr int kCapacity = 32;
  int count;  ///< those beyond kCapacity were not written
  int sign[kCapacity];
  double x[kCapacity];
};

struct TrianglesWithin {
  static constexpr int kCapacity = 32;
  int count;  ///< more than kCapacity: too many
  std::uint32_t slot[kCapacity];
};

/// `warps`: how many at most answer at a time, one question after the other; 0: as many as fit.
void ask(Queue& queue, const WideTree& tree, const DeviceArray<NearestQuestion>& questions,
         DeviceArray<WideNearest>& answers, unsigned warps = 0);
void ask(Queue& queue, const WideTree& tree, const DeviceArray<NearestQuestion>& questions,
         DeviceArray<TrianglesWithin>& answers, unsigned warps = 0);
void ask(Queue& queue, const WideTree& tree, const DeviceArray<ExactQuestion>& questions,
         DeviceArray<WideExact>& answers, unsigned warps = 0);
/// Winding numbers; limits are of no account.
void ask(Queue& queue, const WideTree& tree, const DeviceArray<ExactQuestion>& questions,
         DeviceArray<int>& answers, unsigned warps = 0);
void ask(Queue& queue, const WideTree& tree, const DeviceArray<LineQuestion>& questions,
         DeviceArray<LineCrossings>& answers, unsigned warps = 0);

}  // namespace ist::gpu
