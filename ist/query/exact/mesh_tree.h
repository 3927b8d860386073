#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "query/asset/mesh_parts.h"
#include "query/base/pair_place.h"
#include "query/exact/orientation.h"

namespace ist {

/// The mesh of an asset with its tree of boxes, unit frame.
///
/// Lane l of box block b at level k + 1 is the box around block 16 b + l of level k.
struct MeshTree : MeshParts {
  struct Level {
    const BoxBlock* boxes = nullptr;  ///< level 0 has none
    const BoxSums* sums = nullptr;
    std::uint32_t count = 0;  ///< blocks at this level, level 0 included
    std::uint32_t first = 0;  ///< box blocks of the levels below
  };

  MeshTree() = default;
  MeshTree(const AssetHeader& asset, const MeshHeader& mesh) noexcept
      : MeshParts(asset, mesh),
        hash(asset.content_hash),
        top(static_cast<int>(mesh.level_count) - 1) {
    level[0].count = mesh.level[0].count;
    for (int k = 1; k <= top; ++k) {
      const LevelHeader& from = mesh.level[k];
      level[k] = {at<BoxBlock>(asset, from.blocks), at<BoxSums>(asset, from.nodes), from.count,
                  k > 1 ? level[k - 1].first + level[k - 1].count : 0};
    }
    const BoxBlock& root = level[top].boxes[0];
    for (int k = 0; k < 3; ++k) {
      low[k] = *std::min_element(root.low[k], root.low[k] + kWidth);  // unused ones are empty
      high[k] = *std::max_element(root.high[k], root.high[k] + kWidth);
    }
  }

  /// The same tree in a copy of the asset's bytes.
  MeshTree copied_to(const std::byte* bytes, const AssetHeader& asset) const noexcept {
    const std::ptrdiff_t far = bytes - reinterpret_cast<const std::byte*>(&asset);
    const auto moved = [far]<class T>(const T* from) {
      return from == nullptr
                 ? nullptr
                 : reinterpret_cast<const T*>(reinterpret_cast<const std::byte*>(from) + far);
    };
    MeshTree out = *this;
    out.header = moved(header);
    out.blocks = moved(blocks);
    out.vertices = moved(vertices);
    out.shells = moved(shells);
    out.neighbours = moved(neighbours);
    for (Level& of : out.level) of.boxes = moved(of.boxes), of.sums = moved(of.sums);
    return out;
  }

  IST_HD exact::Point vertex(std::uint32_t v) const noexcept {
    const double* x = vertices + std::size_t{3} * v;
    return {x[0], x[1], x[2]};
  }

  /// A bound of the coordinates.
  IST_HD double extent() const noexcept {
    double extent = 0;
    for (int k = 0; k < 3; ++k)
      extent = std::fmax(extent, std::fmax(std::abs(double{low[k]}), std::abs(double{high[k]})));
    return extent;
  }

  std::uint64_t hash = 0;  ///< of the asset
  int top = 0;             ///< the level of one box block, ≥ 1
  Level level[kMaxLevels];
  float low[3] = {}, high[3] = {};  ///< a box around it
};

/// A node of a mesh in a word: its level, and its number there.
struct MeshNode {
  static constexpr int kShift = 28;
  std::uint32_t word;

  IST_HD static MeshNode at(int level, std::uint32_t number) {
    return {static_cast<std::uint32_t>(level) << kShift | number};
  }
  IST_HD int level() const { return static_cast<int>(word >> kShift); }
  IST_HD std::uint32_t number() const { return word & ((1u << kShift) - 1); }
};

/// A node this many times as large as the other side's is opened alone.
inline constexpr float kOpenedAlone = 2;

/// The rounding of a mesh's box that is placed in float by x ↦ scale · R x + t.
IST_HD inline float placing_pad(double scale, const double (&t)[3], const MeshTree& mesh) noexcept {
  const double shift = std::fmax(std::abs(t[0]), std::fmax(std::abs(t[1]), std::abs(t[2])));
  return static_cast<float>(1e-6 * (2 * scale * mesh.extent() + shift));
}

/// Bound on the distance between the solid's surface and the mesh, unit frame.
IST_HD inline double moved_in_mesh(const MeshTree& mesh) noexcept {
  return mesh.header->error + mesh.header->rounding;
}

/// A bound of the distance of B's vertices from their true places relative to A, A's unit frame. A
/// rotation has an error of up to 37 roundings, mapped points and the translation between the
/// frames at most 45 in all. `offset`: [u] of a unit frame's middle from its solid's origin.
IST_HD inline double moved_by_poses(const double (&t_a)[3], double offset_a, const double (&t_b)[3],
                                    double offset_b, double extent_b,
                                    const PairPlace& pose) noexcept {
  const Vec3 between = vec3(t_b) - vec3(t_a), shift = vec3(pose.a_from_b.t);
  // Summed in Eigen's order.
  const double far = std::sqrt(shift.x * shift.x + (shift.y * shift.y + shift.z * shift.z));
  return 1.1 * exact::kHalfUnit *
         (45 * (1.8 * pose.a_from_b.scale * extent_b +
                (norm(between) + offset_a + offset_b) / pose.unit_a) +
          5 * far);
}

/// The distance within which solids touch. `moved`: the errors of both surfaces.
IST_HD inline double touching_distance(double moved, const MeshTree& a, const MeshTree& b,
                                       const Similarity& a_from_b) noexcept {
  const double shift =
      (std::abs(a_from_b.t[0]) + std::abs(a_from_b.t[1])) + std::abs(a_from_b.t[2]);
  return moved + 4 * exact::kHalfUnit * (a.extent() + a_from_b.scale * b.extent() + shift);
}

/// Faces of touching solids lie on each other if their corners are within this of one plane: a CAD
/// kernel rounds the corners of a face apart, and the planes of its slivers turn with them.
IST_HD constexpr double flush_distance(double touch) noexcept { return 64 * touch; }

}  // namespace ist
