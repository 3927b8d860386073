#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <variant>

#include <ist/field.h>

#include "cuda/query/field_ref.h"
#include "cuda/query/pair_place.h"
#include "query/field/sound_fields.h"

// Host code only: fields in plain numbers. What is out of range is `unusable`.

namespace ist::gpu {

/// The memory that a field points to: heights, distances, an asset's bytes; none of what is out of
/// range.
inline std::span<const std::byte> pointed_to(const Field& field) {
  const auto bytes = [](const auto* from, std::size_t count) {
    return std::as_bytes(std::span(from, count));
  };
  if (const auto* const f = std::get_if<HeightField>(&field); f != nullptr && is_sound(*f))
    return bytes(f->heights, std::size_t{f->columns} * f->rows);
  if (const auto* const g = std::get_if<DistanceGridField>(&field); g != nullptr && is_sound(*g))
    return bytes(g->distances, std::size_t{g->size[0]} * g->size[1] * g->size[2]);
  if (const auto* const m = std::get_if<MeshField>(&field); m != nullptr && is_sound(*m))
    return bytes(reinterpret_cast<const std::byte*>(&m->tree.header()),
                 m->tree.header().file_bytes);
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

/// `at`: where who works on the field finds what it points to.
inline FieldRef field_ref(const Field& field, const std::byte* at) {
  FieldRef ref = {};
  ref.kind = FieldKind::unusable;
  if (!std::visit([](const auto& f) { return is_sound(f); }, field)) return ref;
  const auto* const floats = reinterpret_cast<const float*>(at);
  if (const auto* const f = std::get_if<HalfSpaceField>(&field)) {
    ref.kind = FieldKind::half_space;
    const double length = f->normal.norm();
    ref.half_space.offset = f->offset / length;
    for (int k = 0; k < 3; ++k) ref.half_space.normal[k] = f->normal[k] / length;
  } else if (const auto* const f = std::get_if<BoxField>(&field)) {
    ref.kind = FieldKind::box;
    for (int k = 0; k < 3; ++k) ref.box.half[k] = f->half_extents[k];
  } else if (const auto* const f = std::get_if<BallField>(&field)) {
    ref.kind = FieldKind::ball;
    ref.round = {f->radius, 0};
  } else if (const auto* const f = std::get_if<CapsuleField>(&field)) {
    ref.kind = FieldKind::capsule;
    ref.round = {f->radius, f->half_height};
  } else if (const auto* const f = std::get_if<CylinderField>(&field)) {
    ref.kind = FieldKind::cylinder;
    ref.round = {f->radius, f->half_height};
  } else if (const auto* const f = std::get_if<HeightField>(&field)) {
    if (std::all_of(f->heights, f->heights + std::size_t{f->columns} * f->rows,
                    [](float height) { return std::isfinite(height); }))
      ref.kind = FieldKind::height;
    ref.height = {floats,    f->columns, f->rows, {f->spacing[0], f->spacing[1]},
                  f->lowest, f->highest};
  } else if (const auto* const f = std::get_if<DistanceGridField>(&field)) {
    ref.kind = FieldKind::grid;
    ref.grid = {floats,
                {f->size[0], f->size[1], f->size[2]},
                {f->origin[0], f->origin[1], f->origin[2]},
                f->spacing,
                f->error};
  } else if (const auto* const f = std::get_if<MeshField>(&field)) {
    ref.kind = FieldKind::mesh;
    ref.mesh = SurfaceRef::of(f->tree.header(), at);
  }
  return ref;
}

}  // namespace ist::gpu
