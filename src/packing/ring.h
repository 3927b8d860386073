#pragma once

#include "mesh/host_device.h"

namespace ist::packing {

/// The last few surface features that were closest somewhere near a cell, newest first by use.
/// Children inherit their parent's. It only saves searching: a query is exact without it.
template <class Feature>
struct Ring {
  static constexpr int kCapacity = 8;
  Feature feature[kCapacity];
  int size = 0;
  int next = 0;  ///< slot that is overwritten once the ring is full

  IST_HD void push(const Feature& f) {
    if (size < kCapacity) {
      feature[size++] = f;
    } else {
      feature[next] = f;
      next = (next + 1) % kCapacity;
    }
  }
};

}  // namespace ist::packing
