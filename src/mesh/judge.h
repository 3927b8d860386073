#pragma once

#include <ist/mesh.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>
#include <algorithm>
#include <numeric>

#include "mesh/connectivity/edge_table.h"
#include "mesh/connectivity/weld.h"

namespace ist {

/// The triangles that two meshes share, with equal corners. Runs on the caller's TBB threads.
class TwoMeshes {
 public:
  TwoMeshes(const TriangleMesh& a, const TriangleMesh& b) : first_of_b_(a.vertices.size()) {
    std::vector<Eigen::Vector3d> points = a.vertices;
    points.insert(points.end(), b.vertices.begin(), b.vertices.end());
    number_ = first_equal(points, std::vector<std::uint8_t>(points.size(), 1));
    of_a_ = sorted(a.triangles, false);
    of_b_ = sorted(b.triangles, true);
    shared_of_a_ = shared(a.triangles, false, of_b_);
    shared_of_b_ = shared(b.triangles, true, of_a_);
  }

  /// The triangles of one of them by numbers of their corners, the smallest first. Corners with
  /// equal coordinates have equal numbers.
  std::vector<Triangle> sorted(const std::vector<Triangle>& triangles, bool of_b) const {
    std::vector<Triangle> all(triangles.size());
    tbb::parallel_for(std::size_t{0}, all.size(),
                      [&](std::size_t t) { all[t] = named(triangles[t], of_b); });
    tbb::parallel_sort(all.begin(), all.end());
    return all;
  }
  const std::vector<Triangle>& of_b() const { return of_b_; }

  /// [triangle] 1 if the other mesh has it too, with either orientation.
  const std::vector<std::uint8_t>& shared_of_a() const { return shared_of_a_; }
  const std::vector<std::uint8_t>& shared_of_b() const { return shared_of_b_; }
  /// [vertex] 1 if it is a corner of the other's triangles.
  std::vector<std::uint8_t> corners_of_a() const { return corners(of_b_, 0, first_of_b_); }
  std::vector<std::uint8_t> corners_of_b() const {
    return corners(of_a_, first_of_b_, number_.size());
  }

 private:
  /// For the vertices [first, last): 1 if the triangles of the other mesh use them.
  std::vector<std::uint8_t> corners(const std::vector<Triangle>& others, std::size_t first,
                                    std::size_t last) const {
    std::vector<std::uint8_t> used(number_.size(), 0), result(last - first);
    for (const Triangle& t : others)
      for (const std::uint32_t v : t) used[v] = 1;
    for (std::size_t v = first; v < last; ++v) result[v - first] = used[number_[v]];
    return result;
  }

  Triangle named(const Triangle& t, bool of_b) const {
    Triangle numbers;
    for (std::size_t k = 0; k < 3; ++k) numbers[k] = number_[t[k] + (of_b ? first_of_b_ : 0)];
    std::rotate(numbers.begin(), std::min_element(numbers.begin(), numbers.end()), numbers.end());
    return numbers;
  }

  std::vector<std::uint8_t> shared(const std::vector<Triangle>& triangles, bool of_b,
                                   const std::vector<Triangle>& sorted_others) const {
    std::vector<std::uint32_t> first(number_.size() + 1,
                                     0);  // of the others, by their first corner
    for (const Triangle& other : sorted_others) ++first[other[0] + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::uint8_t> has(triangles.size());
    tbb::parallel_for(std::size_t{0}, has.size(), [&](std::size_t t) {
      const Triangle same = named(triangles[t], of_b), turned = {same[0], same[2], same[1]};
      const auto begin = sorted_others.begin() + first[same[0]];
      const auto end = sorted_others.begin() + first[same[0] + 1];
      has[t] = std::binary_search(begin, end, same) || std::binary_search(begin, end, turned);
    });
    return has;
  }

  std::size_t first_of_b_;
  std::vector<std::uint32_t> number_;  ///< of a's and b's vertices
  std::vector<Triangle> of_a_, of_b_;  ///< sorted
  std::vector<std::uint8_t> shared_of_a_, shared_of_b_;
};

/// Repaired meshes whose confidence is less are refused.
constexpr double kLeastConfidence = 0.6;

/// Fraction of the bounds' diagonal within which a repair counts as preserving the surface.
constexpr double kKept = 1e-4;

/// Compares a closed mesh with the surface that it was made from, whose triangles may have either
/// orientation; see RepairQuality. `kept`: a fraction of the diagonal (kKept). `both`: made from
/// the two meshes. Uses the caller's TBB threads; their number does not change the result.
RepairQuality judge(const TriangleMesh& soup, const ClosedMesh& made, const TwoMeshes& both,
                    double kept);

std::string describe(const RepairQuality& judged);

}  // namespace ist
