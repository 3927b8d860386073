#pragma once

#include <cmath>
#include <cstdint>
#include <type_traits>

#include "cuda/query/exact_memory.h"

// Boxes, slabs and triangles of two meshes, placed in one frame and tested in float.

namespace ist::gpu {

/// How far B may move before a search could find candidates that an older list lacks. A's unit
/// frame; includes the rounding of floats.
struct ExactAhead {
  float centre[3];  ///< of B's box
  float shift;      ///< bound of the centre's motion
  float turn;       ///< bound of the rotation's motion per distance from the centre
  float of_b;       ///< bound of the motion of any point of B

  /// A bound of the motion of points of a box of A as seen from B.
  IST_HD float of_a(const float (&low)[3], const float (&high)[3]) const {
    float square = 0;
    for (int k = 0; k < 3; ++k) {
      const float far = std::fmax(std::abs(low[k] - centre[k]), std::abs(high[k] - centre[k]));
      square = std::fma(far, far, square);
    }
    return std::fma(1.00001f * turn, std::sqrt(square), shift);
  }
};

/// A pair, and how far its search looks ahead.
struct ExactAheadPair : ExactPair {
  ExactAhead ahead;
};

/// `Pair`: ExactAheadPair if the search looks ahead, else ExactPair.
template <class Pair>
class ExactBoxes {
 public:
  static constexpr bool kAhead = std::is_same_v<Pair, ExactAheadPair>;

  IST_HD explicit ExactBoxes(const Pair& pair) : pair_(pair) {}

  /// Decides which of two nodes are opened. Nodes tile a surface, so the comparison is of squared
  /// sizes times both counts.
  IST_HD void open(const MeshNode (&node)[2], bool (&opens)[2]) const {
    const int level[2] = {node[0].level(), node[1].level()};
    const auto scale = static_cast<float>(pair_.place.a_from_b.scale);
    const float size[2] = {static_cast<float>(pair_.mesh[1].level[level[1]].count),
                           scale * scale * static_cast<float>(pair_.mesh[0].level[level[0]].count)};
    constexpr float kAlone = kOpenedAlone * kOpenedAlone;
    opens[0] = level[0] > 0 && (level[1] == 0 || size[1] <= kAlone * size[0]);
    opens[1] = level[1] > 0 && (level[0] == 0 || size[0] <= kAlone * size[1]);
  }

  /// A node's box in its own frame and, widened by rounding, in the other's.
  struct Box {
    float low[3], high[3], other_low[3], other_high[3];
  };

  /// Places a side's node. True if its box intersects that of the other side's node.
  IST_HD bool place_child(int side, MeshNode node, MeshNode other, Box& box) const {
    Box by;
    place(side, node.level(), node.number(), box);
    place(1 - side, other.level(), other.number(), by);
    const float reach = pair_.reach[side], by_reach = pair_.reach[1 - side];
    bool meets = true;
    for (int k = 0; k < 3; ++k) {
      box.low[k] -= reach;
      box.high[k] += reach;
      meets = meets && box.low[k] <= by.other_high[k] && box.high[k] >= by.other_low[k] &&
              by.low[k] - by_reach <= box.other_high[k] &&
              by.high[k] + by_reach >= box.other_low[k];
    }
    return meets;
  }

  /// Writes a side's node in the form that meet() reads. `l`: its lane.
  IST_HD void keep(int side, MeshNode node, std::uint32_t l, const Box& box, ExactBox& out) const {
    const int level = node.level();
    const std::uint32_t n = node.number();
    float normal[3] = {0, 0, 0}, low = -kFar, high = kFar;
    if (level < pair_.mesh[side].top) {
      const BoxBlock& from = in_global_memory(pair_.mesh[side].level[level + 1].boxes)[n / kWidth];
      for (int k = 0; k < 3; ++k) normal[k] = from.normal[k][n % kWidth];
      low = from.slab_low[n % kWidth], high = from.slab_high[n % kWidth];
    }
    const auto scale = static_cast<float>(pair_.place.a_from_b.scale);
    float shift = 0, turned[3], reach[3];
    for (int k = 0; k < 3; ++k) {
      const Quad m = pair_.turn[side][k];
      turned[k] = std::fma(m.x[0], normal[0], std::fma(m.x[1], normal[1], m.x[2] * normal[2]));
      shift = std::fma(turned[k], pair_.row[1][k].x[3], shift);
      reach[k] = scale * (std::abs(turned[k]) + kError);
    }
    if (side == 1) {
      for (int k = 0; k < 3; ++k) normal[k] = turned[k];
      low = scale * low + shift - 2 * pair_.pad[1];
      high = scale * high + shift + 2 * pair_.pad[1];
    }
    float ahead = 0;
    if constexpr (kAhead)
      ahead = side == 0 ? pair_.ahead.of_a(box.low, box.high) : pair_.ahead.of_b;
    out.low = {{box.low[0], box.low[1], box.low[2], low}};
    out.high = {{box.high[0], box.high[1], box.high[2], high}};
    out.other_low = {{box.other_low[0], box.other_low[1], box.other_low[2], 0}};
    out.other_high = {{box.other_high[0], box.other_high[1], box.other_high[2], 0}};
    out.normal = {{normal[0], normal[1], normal[2], ahead}};
    out.turned = {{reach[0], reach[1], reach[2], 0}};
    out.lane = l;
  }

  IST_HD bool meet(const ExactBox& a, const ExactBox& b) const {
    const Quad a_low = a.low, a_high = a.high, b_at = b.other_low, b_to = b.other_high;
    bool meets = true;
    for (int k = 0; k < 3; ++k)
      meets = meets && a_low.x[k] <= b_to.x[k] && a_high.x[k] >= b_at.x[k];
    if (!meets) return false;
    const Quad b_low = b.low, b_high = b.high, a_at = a.other_low, a_to = a.other_high;
    for (int k = 0; k < 3; ++k)
      meets = meets && b_low.x[k] <= a_to.x[k] && b_high.x[k] >= a_at.x[k];
    if (!meets) return false;
    // Each must reach into the other's slab.
    const Quad normal = a.normal, turned = a.turned, normal_b = b.normal;
    float along = 0, reach = pair_.slack, along_b = 0, reach_b = pair_.slack;
    if constexpr (kAhead) reach += normal_b.x[3], reach_b += normal.x[3];
    for (int k = 0; k < 3; ++k) {
      along = std::fma(normal.x[k], 0.5f * (b_at.x[k] + b_to.x[k]), along);
      reach = std::fma(turned.x[k], 0.5f * (b_high.x[k] - b_low.x[k]), reach);
      along_b = std::fma(normal_b.x[k], 0.5f * (a_low.x[k] + a_high.x[k]), along_b);
      reach_b = std::fma(std::abs(normal_b.x[k]), 0.5f * (a_high.x[k] - a_low.x[k]), reach_b);
    }
    return along - reach <= a_high.x[3] && along + reach >= a_low.x[3] &&
           along_b - reach_b <= b_high.x[3] && along_b + reach_b >= b_low.x[3];
  }

  /// Maps a vertex of a side to A's frame.
  IST_HD void place_vertex(int side, float (&at)[3]) const {
    if (side == 0) return;
    const float own[3] = {at[0], at[1], at[2]};
    for (int axis = 0; axis < 3; ++axis) {
      const Quad m = pair_.row[1][axis];
      at[axis] =
          std::fma(m.x[0], own[0], std::fma(m.x[1], own[1], std::fma(m.x[2], own[2], m.x[3])));
    }
  }

  /// The margin of triangles' boxes.
  IST_HD float slack() const {
    if constexpr (kAhead) return pair_.slack + pair_.ahead.of_b;
    return pair_.slack;
  }

  /// Computes a triangle's plane and the error of heights of points in a box that may move by
  /// `ahead`.
  IST_HD void place_plane(const float (&p)[3], const float (&q)[3], const float (&r)[3],
                          const Quad& low, const Quad& high, float ahead,
                          ExactTriangle& out) const {
    float u[3], v[3], longest = 0, farthest = 0;
    for (int k = 0; k < 3; ++k) {
      u[k] = q[k] - p[k];
      v[k] = r[k] - p[k];
      longest = std::fmax(longest, std::fmax(std::abs(u[k]), std::abs(v[k])));
      farthest = std::fmax(farthest, std::fmax(high.x[k] - p[k], p[k] - low.x[k]));
    }
    Quad& n = out.plane;
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      n.x[k] = std::fma(u[l], v[m], -(u[m] * v[l]));
    }
    n.x[3] = -std::fma(n.x[0], p[0], std::fma(n.x[1], p[1], n.x[2] * p[2]));
    // The error includes the motion of points, as in by_plane(), their placement in float, and
    // rounding.
    const float moved = 0.5f * pair_.slack;
    longest += moved;
    farthest += moved;
    if constexpr (kAhead) farthest += 2 * ahead;
    out.margin() = longest * (12 * moved * (2 * farthest + longest) + 4e-6f * longest * farthest);
    // Planes that separate by more than the margin still do after the motion. Doubles decide the
    // rest.
    if constexpr (kAhead)
      out.margin() +=
          1.00001f * ahead * std::sqrt(n.x[0] * n.x[0] + n.x[1] * n.x[1] + n.x[2] * n.x[2]);
  }

  /// True if a triangle, whose k-th corner is corner(k, x), is certainly on one side of the plane.
  template <class Corner>
  IST_HD static bool apart_by(const ExactTriangle& plane, const Corner& corner) {
    const Quad n = plane.plane;
    float least = kFar, most = -kFar;
    for (int k = 0; k < 3; ++k) {
      float x[3];
      corner(k, x);
      const float height =
          std::fma(n.x[0], x[0], std::fma(n.x[1], x[1], std::fma(n.x[2], x[2], n.x[3])));
      least = std::fmin(least, height);
      most = std::fmax(most, height);
    }
    return least > plane.margin() || most < -plane.margin();
  }

 private:
  static constexpr float kError = 4e-7f;  ///< relative error of a few operations
  static constexpr float kFar = 3e38f;    ///< larger than any coordinate

  IST_HD void place(int side, int level, std::uint32_t n, Box& box) const {
    const MeshTree& mesh = pair_.mesh[side];
    if (level == mesh.top) {
      for (int k = 0; k < 3; ++k) box.low[k] = mesh.low[k], box.high[k] = mesh.high[k];
    } else {
      const BoxBlock& from = in_global_memory(mesh.level[level + 1].boxes)[n / kWidth];
      for (int k = 0; k < 3; ++k) {
        box.low[k] = from.low[k][n % kWidth];
        box.high[k] = from.high[k][n % kWidth];
      }
    }
    float middle[3], half[3];
    for (int k = 0; k < 3; ++k) {
      middle[k] = 0.5f * (box.low[k] + box.high[k]);
      half[k] = 0.5f * (box.high[k] - box.low[k]);
    }
    float pad = pair_.pad[side];
    if constexpr (kAhead)
      pad += side == 0 ? 1.00001f * static_cast<float>(pair_.place.b_from_a.scale) *
                             pair_.ahead.of_a(box.low, box.high)
                       : pair_.ahead.of_b;
    for (int k = 0; k < 3; ++k) {
      const Quad m = pair_.row[side][k];
      const float c = std::fma(m.x[0], middle[0],
                               std::fma(m.x[1], middle[1], std::fma(m.x[2], middle[2], m.x[3])));
      const float h = std::fma(std::abs(m.x[0]), half[0],
                               std::fma(std::abs(m.x[1]), half[1], std::abs(m.x[2]) * half[2]));
      const float around = std::fma(1 + kError, h, pad);
      box.other_low[k] = c - around;
      box.other_high[k] = c + around;
    }
  }

  const Pair& pair_;
};

}  // namespace ist::gpu
