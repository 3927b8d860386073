#pragma once

#include <cmath>
#include <cstdint>

#include "query/base/pair_place.h"
#include "query/exact/mesh_tree.h"

// The input of bounds of boxes' distances, in double, on the CPU and on a GPU.

namespace ist {

/// A box by its middle and its slab, in its own frame.
template <class S>
struct MiddleBox {
  S middle[3], half[3];
  S normal[3] = {}, slab_low = 0, slab_high = 0;
};

/// The box of a node: a lane of the block above, or the box of the whole mesh, which has no slab.
template <class S>
IST_HD MiddleBox<S> box_of(const MeshTree& mesh, int level, std::uint32_t i) {
  MiddleBox<S> box;
  if (level == mesh.top) {
    for (int k = 0; k < 3; ++k) {
      box.middle[k] = S(0.5) * (S(mesh.low[k]) + S(mesh.high[k]));
      box.half[k] = S(0.5) * (S(mesh.high[k]) - S(mesh.low[k]));
    }
    return box;
  }
  const BoxBlock& boxes = in_global_memory(mesh.level[level + 1].boxes)[i / kWidth];
  const std::uint32_t l = i % kWidth;
  for (int k = 0; k < 3; ++k) {
    box.middle[k] = S(0.5) * (S(boxes.low[k][l]) + S(boxes.high[k][l]));
    box.half[k] = S(0.5) * (S(boxes.high[k][l]) - S(boxes.low[k][l]));
    box.normal[k] = S(boxes.normal[k][l]);
  }
  box.slab_low = S(boxes.slab_low[l]), box.slab_high = S(boxes.slab_high[l]);
  return box;
}

/// The likely direction of the gap, and two axes perpendicular to it and each other.
struct GapAxes {
  exact::Point axis[3];
};

IST_HD inline GapAxes axes_along(const exact::Point& direction) {
  const double x = std::abs(direction.x), y = std::abs(direction.y), z = std::abs(direction.z);
  const exact::Point least = x <= y && x <= z ? exact::Point{1, 0, 0}
                             : y <= z         ? exact::Point{0, 1, 0}
                                              : exact::Point{0, 0, 1};
  exact::Point beside = cross(direction, least);
  if (const double length = std::sqrt(dot(beside, beside)); length > 0)
    beside = (1 / length) * beside;
  return {{direction, beside, cross(direction, beside)}};
}

/// The same axes in B's frame, with the direction from B to A.
IST_HD inline GapAxes seen_back(const GapAxes& axes, const Similarity& b_from_a, double scale) {
  const double(&m)[9] = b_from_a.m;
  GapAxes out;
  for (int j = 0; j < 3; ++j) {
    const exact::Point& direction = axes.axis[j];
    for (int i = 0; i < 3; ++i)
      out.axis[j][i] = -scale * ((m[3 * i] * direction.x + m[3 * i + 1] * direction.y) +
                                 m[3 * i + 2] * direction.z);
  }
  return out;
}

/// One box of the other mesh in the frame of the boxes that are compared with it. All numbers are
/// relative to its middle.
template <class S>
struct SeenBox {
  S middle[3], hull[3], reach[3], normal[3];
  S low, high;  ///< its slab
  S nearest;    ///< its extent backwards along the direction
  S across[2];  ///< and across it
};

/// Compares boxes of one mesh with a box of the other: along their own axes, along the other's,
/// along the normals of all slabs, and along the likely direction of the answer. Boxes are in lanes
/// of T, the other's in S.
template <class T, class S>
struct BoxLook {
  S m[9], shift[3], scale;  ///< from the other's frame to theirs
  S axis[3][3];             ///< the other's, in their frame
  S along[3][3] = {};       ///< [direction][axis of the other]: their product
  S blur;                   ///< the error of a coordinate
  // For lanes. The first direction leads from the boxes to the other, two are perpendicular to it.
  T lane_axis[3][3], abs_axis[3][3], lane_direction[3][3] = {}, abs_direction[3][3] = {};

  BoxLook() = default;
  /// `map` leads from the other's frame to theirs.
  IST_HD BoxLook(const Similarity& map, double off)
      : scale(static_cast<S>(map.scale)), blur(static_cast<S>(off)) {
    const double inverse = 1 / map.scale;
    for (int i = 0; i < 3; ++i) {
      shift[i] = static_cast<S>(map.t[i]);
      for (int k = 0; k < 3; ++k) {
        m[3 * i + k] = static_cast<S>(map.m[3 * i + k]);
        axis[k][i] = static_cast<S>(map.m[3 * i + k] * inverse);
        lane_axis[k][i] = static_cast<T>(axis[k][i]);
        abs_axis[k][i] = std::abs(lane_axis[k][i]);
      }
    }
  }

  /// Sets the axes. The first, of length 1, leads from the boxes to the other mesh; or all are
  /// zero.
  IST_HD void turn(const GapAxes& axes) {
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) turn(axes.axis[j], axes.axis[j][k], j, k);
  }
  /// Sets component k of the j-th axis.
  IST_HD void turn(const exact::Point& direction, double component, int j, int k) {
    along[j][k] =
        static_cast<S>((direction.x * double{axis[k][0]} + direction.y * double{axis[k][1]}) +
                       direction.z * double{axis[k][2]});
    lane_direction[j][k] = static_cast<T>(component);
    abs_direction[j][k] = std::abs(lane_direction[j][k]);
  }

  IST_HD SeenBox<S> see(const MiddleBox<S>& one) const {
    SeenBox<S> out;
    for (int i = 0; i < 3; ++i) {
      out.middle[i] = (m[3 * i] * one.middle[0] + m[3 * i + 1] * one.middle[1]) +
                      m[3 * i + 2] * one.middle[2] + shift[i];
      out.reach[i] = scale * one.half[i] + blur;
    }
    for (int i = 0; i < 3; ++i) {
      out.hull[i] = (std::abs(axis[0][i]) * out.reach[0] + std::abs(axis[1][i]) * out.reach[1]) +
                    std::abs(axis[2][i]) * out.reach[2];
      out.normal[i] =
          (axis[0][i] * one.normal[0] + axis[1][i] * one.normal[1]) + axis[2][i] * one.normal[2];
    }
    const S before = (one.normal[0] * one.middle[0] + one.normal[1] * one.middle[1]) +
                     one.normal[2] * one.middle[2];
    out.low = scale * (one.slab_low - before), out.high = scale * (one.slab_high - before);
    const S(&along_direction)[3] = along[0];
    const S turned = (along_direction[0] * one.normal[0] + along_direction[1] * one.normal[1]) +
                     along_direction[2] * one.normal[2];
    S by_box = 0, by_slab = std::fmin(turned * out.low, turned * out.high);
    out.across[0] = out.across[1] = 0;
    for (int k = 0; k < 3; ++k) {
      by_box -= out.reach[k] * std::abs(along_direction[k]);
      by_slab -= out.reach[k] * std::abs(along_direction[k] - turned * one.normal[k]);
      for (int j = 0; j < 2; ++j) out.across[j] += out.reach[k] * std::abs(along[1 + j][k]);
    }
    out.nearest = std::fmax(by_box, by_slab) - 3 * blur;
    return out;
  }
};

}  // namespace ist
