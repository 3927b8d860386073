#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <variant>

#include <ist/field.h>

#include "cuda/query/field_ref.h"
#include "cuda/query/pair_place.h"
#include "query/asset/shared_constants.h"

// Host code only: fields in plain numbers. What is out of range is `unusable`, as the shapes of
// query/field/ are not sound.

namespace ist::gpu {

inline bool is_length(double x) { return x > 0 && x <= 1e150; }
inline bool is_place(double x) { return std::abs(x) <= 1e150; }

/// The memory that a field points to: heights, distances, an asset's bytes; none of what is out of
/// range.
inline std::span<const std::byte> pointed_to(const Field& field) {
  const auto bytes = [](const auto* from, std::size_t count) {
    return std::as_bytes(std::span(from, count));
  };
  if (const auto* const f = std::get_if<HeightField>(&field)) {
    if (f->heights != nullptr && f->columns <= 1u << 20 && f->rows <= 1u << 20)
      return bytes(f->heights, std::size_t{f->columns} * f->rows);
  } else if (const auto* const g = std::get_if<DistanceGridField>(&field)) {
    for (const std::uint32_t n : g->size)
      if (n > 1u << 20) return {};
    if (g->distances != nullptr)
      return bytes(g->distances, std::size_t{g->size[0]} * g->size[1] * g->size[2]);
  } else if (const auto* const m = std::get_if<MeshField>(&field)) {
    if (m->tree.has_field())
      return bytes(reinterpret_cast<const std::byte*>(&m->tree.header()),
                   m->tree.header().file_bytes);
  }
  return {};
}

inline AssetFrame frame_of(const AssetHeader& header) {
  return {{header.centre[0], header.centre[1], header.centre[2]}, std::ldexp(1.0, header.exponent)};
}
inline AssetFrame frame_of(const Field& field) {
  const auto* const mesh = std::get_if<MeshField>(&field);
  return mesh != nullptr && mesh->tree.has_field() ? frame_of(mesh->tree.header())
                                                   : AssetFrame{{0, 0, 0}, 1};
}

/// A field that is no FunctionField, `at` being where who works on it finds what it points to.
inline FieldRef field_ref(const Field& field, const std::byte* at) {
  FieldRef ref = {};
  const auto kind = [](bool sound, FieldKind is) { return sound ? is : FieldKind::unusable; };
  const auto* const floats = reinterpret_cast<const float*>(at);
  if (const auto* const f = std::get_if<HalfSpaceField>(&field)) {
    const double length = f->normal.norm();
    ref.kind = kind(
        length >= kShortestDirection && length <= kLongestDirection && is_place(f->offset / length),
        FieldKind::half_space);
    ref.half_space.offset = f->offset / length;
    for (int k = 0; k < 3; ++k) ref.half_space.normal[k] = f->normal[k] / length;
  } else if (const auto* const f = std::get_if<BoxField>(&field)) {
    const Eigen::Vector3d& half = f->half_extents;
    ref.kind = kind(is_length(half[0]) && is_length(half[1]) && is_length(half[2]), FieldKind::box);
    for (int k = 0; k < 3; ++k) ref.box.half[k] = half[k];
  } else if (const auto* const f = std::get_if<BallField>(&field)) {
    ref.kind = kind(is_length(f->radius), FieldKind::ball);
    ref.round = {f->radius, 0};
  } else if (const auto* const f = std::get_if<CapsuleField>(&field)) {
    ref.kind = kind(is_length(f->radius) && f->half_height >= 0 && f->half_height <= 1e150,
                    FieldKind::capsule);
    ref.round = {f->radius, f->half_height};
  } else if (const auto* const f = std::get_if<CylinderField>(&field)) {
    ref.kind = kind(is_length(f->radius) && is_length(f->half_height), FieldKind::cylinder);
    ref.round = {f->radius, f->half_height};
  } else if (const auto* const f = std::get_if<HeightField>(&field)) {
    ref.kind = kind(f->heights != nullptr && f->columns >= 2 && f->rows >= 2 &&
                        f->columns <= 1u << 20 && f->rows <= 1u << 20 && is_length(f->spacing[0]) &&
                        is_length(f->spacing[1]) && f->lowest <= f->highest &&
                        std::all_of(f->heights, f->heights + std::size_t{f->columns} * f->rows,
                                    [](float height) { return std::isfinite(height); }),
                    FieldKind::height);
    ref.height = {floats,    f->columns, f->rows, {f->spacing[0], f->spacing[1]},
                  f->lowest, f->highest};
  } else if (const auto* const f = std::get_if<DistanceGridField>(&field)) {
    bool sound = f->distances != nullptr && is_length(f->spacing) && f->error >= 0 &&
                 f->error <= 1e150 && f->origin.allFinite();
    for (const std::uint32_t n : f->size) sound = sound && n >= 2 && n <= 1u << 20;
    ref.kind = kind(sound, FieldKind::grid);
    ref.grid = {floats,
                {f->size[0], f->size[1], f->size[2]},
                {f->origin[0], f->origin[1], f->origin[2]},
                f->spacing,
                f->error};
  } else if (const auto* const f = std::get_if<MeshField>(&field)) {
    ref.kind = kind(f->tree.has_field(), FieldKind::mesh);
    if (ref.kind == FieldKind::mesh) ref.mesh = SurfaceRef::of(f->tree.header(), at);
  }
  return ref;
}

}  // namespace ist::gpu
