#pragma once

#include "mesh/host_device.h"

namespace ist::packing {

/// The last few surface features that were closest somewhere near a cell. Children inherit their
/// parent's. Each gives a constraint without a search; the oldest makes room for a new one.
template <class Feature>
struct Ring {
  static constexpr int kCapacity = 8;
  Feature feature[kCapacity];
  int size = 0;
  int next = 0;

  IST_HD void push(const Feature& f) {
    feature[next] = f;
    next = (next + 1) % kCapacity;
    if (size < kCapacity) ++size;
  }
};

}  // namespace ist::packing
