#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <atomic>
#include <cstddef>

#include "base/aside.h"
#include "mesh/connectivity/edge_table.h"
#include "mesh/resolve/exact_points.h"

namespace ist {

/// Work that another thread watches and may end.
class WatchedWork : public WorkStop {
 public:
  /// Calls each(i) for all i < count on the caller's TBB threads: `share` of all work. Throws
  /// Stopped soon after stop() was called.
  template <class Each>
  void for_each(std::size_t count, double share, const Each& each) {
    constexpr std::size_t kTold = 64;  // at a time: threads that write the same place wait
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count), [&](const auto& range) {
      for (std::size_t i = range.begin(), from = i; i < range.end(); ++i) {
        look();
        each(i);
        if (i + 1 - from < kTold && i + 1 < range.end()) continue;
        done_.fetch_add(share * static_cast<double>(i + 1 - from) / static_cast<double>(count),
                        std::memory_order_relaxed);
        from = i + 1;
      }
    });
  }

  double done() const { return done_.load(std::memory_order_relaxed); }  ///< the sum of shares

 private:
  std::atomic<double> done_ = 0;
};

/// A mesh's triangles, cut where they meet: pieces share nothing but whole sides and corners.
struct Arrangement {
  ExactPoints points;
  std::vector<Triangle> pieces;       ///< corners by the points' numbers
  std::vector<std::uint32_t> source;  ///< [piece] a triangle of the mesh in whose plane it lies
  std::vector<int> winding_step;      ///< [piece] > 0: of the winding number, to behind it
  std::vector<std::uint32_t> plane;   ///< [triangle] those in one plane that meet have the same
  std::vector<std::uint32_t> walls;   ///< by `plane`: where pieces cancelled each other
};

/// Leaves out triangles on a line, and pieces that others cancel by facing the other side. `pairs`:
/// the intersecting ones. Deterministic. Throws Unresolvable, and what `work` throws.
Arrangement arrange(const std::vector<Eigen::Vector3d>& vertices,
                    const std::vector<Triangle>& triangles,
                    std::span<const std::array<std::uint32_t, 2>> pairs, WatchedWork& work);

}  // namespace ist
