#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <atomic>
#include <cstddef>
#include <unordered_map>

#include "base/thread_arena.h"
#include "mesh/connectivity/edge_table.h"
#include "mesh/resolve/exact_points.h"

namespace ist {

/// A triangulation of points in a plane, projected along a coordinate axis, that contains given
/// segments. Exact, even for collinear points.
class PlanarTriangulation {
 public:
  /// `frame`: three points around all others. `inner`: the points, unique.
  PlanarTriangulation(const ExactPoints& points, int axis,
                      const std::array<std::uint32_t, 3>& frame,
                      const std::vector<std::uint32_t>& inner);

  /// Inserts a segment between two of the points. Nothing else may lie on it or cross it. `of`
  /// selects one of two kinds of curves, whose winding number rises by `step` from its right to its
  /// left.
  void insert(std::uint32_t from, std::uint32_t to, int step, std::size_t of);

  /// Flips edges that are no segments if that makes triangles rounder.
  void make_round();

  struct Covered {
    Triangle triangle;           ///< counter-clockwise
    std::array<int, 2> winding;  ///< not both 0
  };
  /// Triangles with a nonzero winding number of either kind.
  std::vector<Covered> covered() const;

 private:
  struct Cell {
    std::array<std::uint32_t, 3> corner;  ///< counter-clockwise
    std::array<std::uint32_t, 3> beyond;  ///< the cell across from each corner
  };
  struct Place {
    std::uint32_t cell, corner;
  };

  int turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return points_.turn(axis_, a, b, c);
  }
  bool is_frame(std::uint32_t p) const {
    return p == frame_[0] || p == frame_[1] || p == frame_[2];
  }
  void insert_point(std::uint32_t p);
  std::uint32_t cell_of(std::uint32_t p);
  void flip(Place edge);
  bool can_flip(Place edge) const;
  bool is_sharp(Place edge) const;
  Place place_of(std::uint32_t corner) const;
  Place next_about(Place place) const;
  Place edge_between(std::uint32_t a, std::uint32_t b) const;
  void set(std::uint32_t cell, const Cell& value);
  void hand_over(std::uint32_t cell, std::uint32_t from, std::uint32_t to);
  static std::uint64_t key(std::uint32_t from, std::uint32_t to) {
    return std::uint64_t{from} << 32 | to;
  }
  bool is_segment(Place edge) const;

  const ExactPoints& points_;
  int axis_;
  std::array<std::uint32_t, 3> frame_;
  std::vector<Cell> cells_;
  std::unordered_map<std::uint32_t, std::uint32_t> cell_at_;  ///< [point]
  /// Steps along segments, keyed by the smaller number.
  std::unordered_map<std::uint64_t, std::array<int, 2>> steps_;
  std::uint64_t random_ = 1;
};

/// Cancellable work with progress that another thread watches.
class WatchedWork : public WorkStop {
 public:
  /// Calls each(i) for all i < count on the caller's TBB threads: `share` of all work. Throws
  /// Stopped soon after stop() was called.
  template <class Each>
  void for_each(std::size_t count, double share, const Each& each) {
    constexpr std::size_t kTold =
        64;  // items per update, as threads that write the same number wait for each other
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

/// A mesh's triangles, cut where they meet: pieces share only whole sides and corners.
struct Arrangement {
  ExactPoints points;
  std::vector<Triangle> pieces;       ///< corners by the points' numbers
  std::vector<std::uint32_t> source;  ///< [piece] a triangle of the mesh in the same plane
  std::vector<int> winding_step;      ///< [piece] > 0: rise of the winding number to its back
  std::vector<std::uint32_t> plane;   ///< [triangle] triangles in one plane that meet have the same
  std::vector<std::uint32_t> walls;   ///< by `plane`: walls where pieces cancelled each other
};

/// Leaves out degenerate triangles, and pieces cancelled by others of opposite orientation.
/// `pairs`: the intersecting ones. Deterministic. Throws Unresolvable, and what `work` throws.
Arrangement arrange(const std::vector<Eigen::Vector3d>& vertices,
                    const std::vector<Triangle>& triangles,
                    std::span<const std::array<std::uint32_t, 2>> pairs, WatchedWork& work);

}  // namespace ist
