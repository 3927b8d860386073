#pragma once

#include <limits>
#include <variant>

#include <ist/field.h>
#include <ist/query.h>
#include <ist/time_of_impact.h>

// Answers to what an asset cannot be asked: every number is NaN, which nobody takes for no contact.

namespace ist {

/// It is a surface alone.
inline bool lacks_spheres(const TreeView& tree) noexcept {
  return !tree.empty() && tree.sphere_count() == 0;
}
inline bool lacks_spheres(const PlacedTree& placed) noexcept { return lacks_spheres(placed.tree); }
inline bool lacks_spheres(const PlacedField& placed) noexcept {
  const MeshField* const mesh = std::get_if<MeshField>(&placed.field);
  return mesh != nullptr && lacks_spheres(mesh->tree);
}
template <class Solid>
bool lack_spheres(const Solid& a, const PlacedTree& b) noexcept {
  return lacks_spheres(a) || lacks_spheres(b);
}

template <class Answer>
Answer not_held() noexcept;

template <>
inline Penetration not_held() noexcept {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Vector3d none = Eigen::Vector3d::Constant(kNone);
  return {kNone, kNone, kNone, none, none, none, QueryStatus::not_held};
}

template <>
inline ContactPatches not_held() noexcept {
  return {not_held<Penetration>()};
}

template <>
inline Separation not_held() noexcept {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Vector3d none = Eigen::Vector3d::Constant(kNone);
  return {kNone, kNone, kNone, none, none, none, QueryStatus::not_held};
}

template <>
inline TimeOfImpact not_held() noexcept {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  TimeOfImpact result;
  result.status = ImpactStatus::not_held;
  result.time = result.distance_min = result.distance_max = kNone;
  result.point_a = result.point_b = result.normal = Eigen::Vector3d::Constant(kNone);
  return result;
}

}  // namespace ist
