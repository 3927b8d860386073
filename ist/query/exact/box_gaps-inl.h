// How far boxes of a mesh are from a box of the other one, sixteen at a time: included once a
// target.

#if defined(IST_QUERY_BOX_GAPS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_BOX_GAPS_INL_H_
#undef IST_QUERY_BOX_GAPS_INL_H_
#else
#define IST_QUERY_BOX_GAPS_INL_H_
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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

/// The way that an answer is likely to go, and two axes square to it and each other.
using WayAxes = std::array<exact::Point, 3>;

inline WayAxes axes_along(const exact::Point& way) {
  const double x = std::abs(way.x), y = std::abs(way.y), z = std::abs(way.z);
  const exact::Point least = x <= y && x <= z ? exact::Point{1, 0, 0}
                             : y <= z         ? exact::Point{0, 1, 0}
                                              : exact::Point{0, 0, 1};
  exact::Point beside = cross(way, least);
  if (const double length = std::sqrt(dot(beside, beside)); length > 0)
    beside = (1 / length) * beside;
  return {way, beside, cross(way, beside)};
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
      for (int k = 0; k < 3; ++k) {
        axis_[k][i] = map.m[3 * i + k] * inverse;
        lane_axis_[k][i] = static_cast<T>(axis_[k][i]);
        abs_axis_[k][i] = std::abs(lane_axis_[k][i]);
      }
  }

  /// The first of the axes, of length 1, goes from the boxes to the other mesh; or all are zero.
  void turn(const WayAxes& axes) {
    for (int j = 0; j < 3; ++j) {
      const exact::Point& way = axes[static_cast<std::size_t>(j)];
      const double u[3] = {way.x, way.y, way.z};
      for (int k = 0; k < 3; ++k) {
        along_[j][k] = (u[0] * axis_[k][0] + u[1] * axis_[k][1]) + u[2] * axis_[k][2];
        lane_way_[j][k] = static_cast<T>(u[k]);
        abs_way_[j][k] = std::abs(lane_way_[j][k]);
      }
    }
  }

  /// Which of sixteen boxes may be within `limit`, squared, of `one` of the other mesh: a bit each.
  /// Of these come the squared distances, or less, and `apart`: the largest gap along any axis,
  /// which is negative where both overlap along all of them.
  HWY_INLINE std::uint32_t measure(const BoxBlock& boxes, const MiddleBox& one, double limit,
                                   T (&squared)[kWidth], T (&apart)[kWidth]) const {
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
    const double(&along_way)[3] = along_[0];
    const double turned = (along_way[0] * one.normal[0] + along_way[1] * one.normal[1]) +
                          along_way[2] * one.normal[2];
    double by_box = 0, by_slab = std::min(turned * low, turned * high), beside_way[2] = {};
    for (int k = 0; k < 3; ++k) {
      by_box -= reach[k] * std::abs(along_way[k]);
      by_slab -= reach[k] * std::abs(along_way[k] - turned * one.normal[k]);
      for (int j = 0; j < 2; ++j) beside_way[j] += reach[k] * std::abs(along_[1 + j][k]);
    }
    const double nearest = std::max(by_box, by_slab) - 3 * blur_;

    const LaneTag<T> d;
    using V = hn::Vec<decltype(d)>;
    const auto set = [&](double x) { return hn::Set(d, static_cast<T>(x)); };
    const V zero = hn::Zero(d), half_one = set(0.5);
    constexpr double kLength = 1 - 1e-5;  // of normals, or more
    constexpr double kRounding = sizeof(T) == sizeof(float) ? 2e-6 : 1e-14;
    const V beyond =
        set(std::min(limit, double{std::numeric_limits<T>::max()} / 4) * (1 + 4 * kRounding));
    std::uint32_t within = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      V away[3], half[3], n[3];
      V along = zero, across = zero, largest = hn::Neg(set(1e30));
      const auto squared_gap = [&](V gap) {
        largest = hn::Max(largest, gap);
        const V positive = hn::Max(zero, gap);
        return positive * positive;
      };
      for (int i = 0; i < 3; ++i) {
        const V x = load_as<T>(d, boxes.low[i] + l), y = load_as<T>(d, boxes.high[i] + l);
        away[i] = half_one * (x + y) - set(middle[i]);
        half[i] = half_one * (y - x);
        n[i] = load_as<T>(d, boxes.normal[i] + l);
        along = along + squared_gap(hn::Abs(away[i]) - (half[i] + set(hull[i])));
      }
      const auto times = [&](const T(&u)[3], const V(&x)[3]) {
        return (hn::Set(d, u[0]) * x[0] + hn::Set(d, u[1]) * x[1]) + hn::Set(d, u[2]) * x[2];
      };
      // Beside the way, by boxes.
      V beside = zero;
      for (int j = 0; j < 2; ++j) {
        beside = beside + squared_gap(hn::Abs(times(lane_way_[1 + j], away)) -
                                      (times(abs_way_[1 + j], half) + set(beside_way[j])));
      }
      const V ahead = times(lane_way_[0], away) + times(abs_way_[0], half);
      const V box_ahead = hn::Max(zero, set(kLength * nearest) - set(kLength) * ahead);
      const V by_boxes = hn::Max(along, box_ahead * box_ahead + beside);
      if (hn::AllTrue(d, by_boxes > beyond)) continue;
      for (int k = 0; k < 3; ++k) {
        across = across + squared_gap(hn::Abs(times(lane_axis_[k], away)) -
                                      (times(abs_axis_[k], half) + set(reach[k])));
      }
      // n is `turn` times the other normal and a rest, by which only boxes are known.
      const V turn = (n[0] * set(normal[0]) + n[1] * set(normal[1])) + n[2] * set(normal[2]);
      const V steep = times(lane_way_[0], n);
      V at_middle = zero, at_box = zero, other_at_box = zero, to_box = zero, of_slab = zero;
      V rest[3];
      for (int i = 0; i < 3; ++i) {
        const V rest_of_way = hn::Set(d, lane_way_[0][i]) - steep * n[i];
        of_slab = of_slab + (rest_of_way * away[i] + hn::Abs(rest_of_way) * half[i]);
        rest[i] = n[i] - turn * set(normal[i]);
        const V other_rest = set(normal[i]) - turn * n[i];
        at_middle = at_middle + n[i] * set(middle[i]);
        other_at_box = other_at_box + hn::Abs(other_rest) * half[i];
        to_box = to_box + other_rest * away[i];
      }
      for (int k = 0; k < 3; ++k)
        at_box = at_box + set(reach[k]) * hn::Abs(times(lane_axis_[k], rest));
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
      const V ahead_gap = squared_gap(set(kLength) * (set(nearest) - hn::Min(ahead, of_slab))),
              slab_gap = set(kLength) * slab;
      hn::Store(largest, d, apart + l);
      const V least =
          hn::Max(hn::Max(along, across), hn::Max(slab_gap * slab_gap, ahead_gap + beside));
      hn::Store(set(1 - kRounding) * least, d, squared + l);
      within |= mask_bits(d, least <= beyond) << l;
    }
    return within;
  }

 private:
  const Similarity& map_;
  const double blur_;
  double axis_[3][3];        ///< the other's, in their frame
  double along_[3][3] = {};  ///< [way][axis of the other]: their product
  // For lanes; ways go from the boxes to the other, and two beside that.
  T lane_axis_[3][3], abs_axis_[3][3], lane_way_[3][3] = {}, abs_way_[3][3] = {};
};

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
