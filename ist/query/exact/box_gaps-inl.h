// How far boxes of a mesh are from a box of the other one, sixteen at a time: included once a
// target.

#if defined(IST_QUERY_BOX_GAPS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_BOX_GAPS_INL_H_
#undef IST_QUERY_BOX_GAPS_INL_H_
#else
#define IST_QUERY_BOX_GAPS_INL_H_
#endif

#include <algorithm>
#include <cmath>

#include "query/base/pair_place.h"
#include "query/exact/mesh_tree.h"
#include "query/kernel/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// A box by its middle and its slab, in its own frame.
struct MiddleBox {
  double middle[3], half[3];
  double normal[3] = {}, slab_low = 0, slab_high = 0;
};

/// The longest side of a node's box.
inline double size_of(const MeshTree& mesh, int level, std::uint32_t i) {
  float size = 0;
  for (int k = 0; k < 3; ++k) {
    if (level == mesh.top) {
      size = std::max(size, mesh.high[k] - mesh.low[k]);
    } else {
      const BoxBlock& boxes = mesh.level[level + 1].boxes[i / kWidth];
      size = std::max(size, boxes.high[k][i % kWidth] - boxes.low[k][i % kWidth]);
    }
  }
  return double{size};
}

/// The box of a node: a lane of the block above, or that of the whole mesh, which has no slab.
inline MiddleBox box_of(const MeshTree& mesh, int level, std::uint32_t i) {
  MiddleBox box;
  if (level == mesh.top) {
    for (int k = 0; k < 3; ++k) {
      box.middle[k] = 0.5 * (double{mesh.low[k]} + mesh.high[k]);
      box.half[k] = 0.5 * (double{mesh.high[k]} - mesh.low[k]);
    }
    return box;
  }
  const BoxBlock& boxes = mesh.level[level + 1].boxes[i / kWidth];
  const std::uint32_t l = i % kWidth;
  for (int k = 0; k < 3; ++k) {
    box.middle[k] = 0.5 * (double{boxes.low[k][l]} + boxes.high[k][l]);
    box.half[k] = 0.5 * (double{boxes.high[k][l]} - boxes.low[k][l]);
    box.normal[k] = boxes.normal[k][l];
  }
  box.slab_low = boxes.slab_low[l], box.slab_high = boxes.slab_high[l];
  return box;
}

/// How boxes of one mesh are seen from the other's frame: along their own axes, along the other's,
/// along the normals of all slabs, and along the way that the answer is likely to go.
template <class T>
class BoxLook {
 public:
  /// `map` goes from the other's frame to theirs. A coordinate there may be off by `blur`.
  BoxLook(const Similarity& map, double blur) : map_(map), blur_(blur) {
    const double inverse = 1 / map.scale;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) axis_[k][i] = map.m[3 * i + k] * inverse;
    turn({0, 0, 0});
  }

  /// `toward`: unit, from the boxes to the other mesh; or zero.
  void turn(const exact::Point& toward) {
    toward_[0] = toward.x, toward_[1] = toward.y, toward_[2] = toward.z;
    for (int k = 0; k < 3; ++k)
      along_[k] = (toward_[0] * axis_[k][0] + toward_[1] * axis_[k][1]) + toward_[2] * axis_[k][2];
  }

  /// Squared distances of sixteen boxes from `one` of the other mesh, or less.
  HWY_INLINE void measure(const BoxBlock& boxes, const MiddleBox& one, T (&squared)[kWidth]) const {
    double middle[3], hull[3], reach[3], normal[3];
    map_.apply(one.middle, middle);
    for (int i = 0; i < 3; ++i) reach[i] = map_.scale * one.half[i] + blur_;
    for (int i = 0; i < 3; ++i) {
      hull[i] = (std::abs(axis_[0][i]) * reach[0] + std::abs(axis_[1][i]) * reach[1]) +
                std::abs(axis_[2][i]) * reach[2];
      normal[i] =
          (axis_[0][i] * one.normal[0] + axis_[1][i] * one.normal[1]) + axis_[2][i] * one.normal[2];
    }
    // Its slab from its middle; all below is told from there.
    const double before = (one.normal[0] * one.middle[0] + one.normal[1] * one.middle[1]) +
                          one.normal[2] * one.middle[2];
    const double low = map_.scale * (one.slab_low - before),
                 high = map_.scale * (one.slab_high - before);
    // How far it reaches back along the way.
    const double turned =
        (along_[0] * one.normal[0] + along_[1] * one.normal[1]) + along_[2] * one.normal[2];
    double by_box = 0, by_slab = std::min(turned * low, turned * high);
    for (int k = 0; k < 3; ++k) {
      by_box -= reach[k] * std::abs(along_[k]);
      by_slab -= reach[k] * std::abs(along_[k] - turned * one.normal[k]);
    }
    const double nearest = std::max(by_box, by_slab) - 3 * blur_;

    const LaneTag<T> d;
    using V = hn::Vec<decltype(d)>;
    const auto set = [&](double x) { return hn::Set(d, static_cast<T>(x)); };
    const V zero = hn::Zero(d), half_one = set(0.5);
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      V away[3], half[3], n[3];
      V along = zero, across = zero, ahead = zero;
      for (int i = 0; i < 3; ++i) {
        const V x = load_as<T>(d, boxes.low[i] + l), y = load_as<T>(d, boxes.high[i] + l);
        away[i] = half_one * (x + y) - set(middle[i]);
        half[i] = half_one * (y - x);
        n[i] = load_as<T>(d, boxes.normal[i] + l);
        const V gap = hn::Max(zero, hn::Abs(away[i]) - (half[i] + set(hull[i])));
        along = along + gap * gap;
        ahead = ahead + (set(toward_[i]) * away[i] + set(std::abs(toward_[i])) * half[i]);
      }
      for (int k = 0; k < 3; ++k) {
        const double* const u = axis_[k];
        const V between = (set(u[0]) * away[0] + set(u[1]) * away[1]) + set(u[2]) * away[2];
        const V width = (set(std::abs(u[0])) * half[0] + set(std::abs(u[1])) * half[1]) +
                        set(std::abs(u[2])) * half[2];
        const V gap = hn::Max(zero, hn::Abs(between) - (width + set(reach[k])));
        across = across + gap * gap;
      }
      // n is `turn` times the other normal and a rest, by which only boxes are known.
      const V turn = (n[0] * set(normal[0]) + n[1] * set(normal[1])) + n[2] * set(normal[2]);
      const V steep = (n[0] * set(toward_[0]) + n[1] * set(toward_[1])) + n[2] * set(toward_[2]);
      V at_middle = zero, at_box = zero, other_at_box = zero, to_box = zero, of_slab = zero;
      V rest[3];
      for (int i = 0; i < 3; ++i) {
        const V beside = set(toward_[i]) - steep * n[i];
        of_slab = of_slab + (beside * away[i] + hn::Abs(beside) * half[i]);
        rest[i] = n[i] - turn * set(normal[i]);
        const V other_rest = set(normal[i]) - turn * n[i];
        at_middle = at_middle + n[i] * set(middle[i]);
        other_at_box = other_at_box + hn::Abs(other_rest) * half[i];
        to_box = to_box + other_rest * away[i];
      }
      for (int k = 0; k < 3; ++k)
        at_box = at_box +
                 set(reach[k]) * hn::Abs((set(axis_[k][0]) * rest[0] + set(axis_[k][1]) * rest[1]) +
                                         set(axis_[k][2]) * rest[2]);
      // Along n, from the one's middle: it, and the lane's slab.
      const V slab_low = load_as<T>(d, boxes.slab_low + l) - at_middle,
              slab_high = load_as<T>(d, boxes.slab_high + l) - at_middle;
      const V turn_low = turn * set(low), turn_high = turn * set(high);
      const V of_low = turn * slab_low, of_high = turn * slab_high;
      const V gap = hn::Max(slab_low - (hn::Max(turn_low, turn_high) + at_box),
                            (hn::Min(turn_low, turn_high) - at_box) - slab_high);
      const V other_gap = hn::Max(set(low) - ((to_box + hn::Max(of_low, of_high)) + other_at_box),
                                  ((to_box + hn::Min(of_low, of_high)) - other_at_box) - set(high));
      const V slab = hn::Max(zero, hn::Max(gap, other_gap) - set(3 * blur_));
      of_slab = of_slab + hn::Max(steep * slab_low, steep * slab_high);
      const V ahead_gap = hn::Max(zero, set(nearest) - hn::Min(ahead, of_slab));
      constexpr double kLength = 1 - 1e-5;  // of normals, or more
      const V farthest = hn::Max(set(kLength) * slab, ahead_gap);
      constexpr double kRounding = sizeof(T) == sizeof(float) ? 2e-6 : 1e-14;
      hn::Store(set(1 - kRounding) * hn::Max(hn::Max(along, across), farthest * farthest), d,
                squared + l);
    }
  }

 private:
  const Similarity& map_;
  const double blur_;
  double axis_[3][3];  ///< the other's, in their frame
  double toward_[3];
  double along_[3];  ///< of the other's axes
};

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
