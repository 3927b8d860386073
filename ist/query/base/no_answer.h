#pragma once

#include <limits>
#include <type_traits>

#include <ist/query.h>
#include <ist/shapes.h>
#include <ist/time_of_impact.h>

// Answers of failed queries: every number is NaN, which cannot be mistaken for no contact.

namespace ist {

inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// True if the asset is a mesh alone.
inline bool lacks_spheres(const AssetView& tree) noexcept {
  return !tree.empty() && tree.sphere_count() == 0;
}
inline bool lacks_spheres(const PlacedAsset& placed) noexcept {
  return lacks_spheres(placed.asset);
}
inline bool lack_spheres(const PlacedAsset& a, const PlacedAsset& b) noexcept {
  return lacks_spheres(a) || lacks_spheres(b);
}
inline bool lack_spheres(const PlacedShape&, const PlacedAsset& b) noexcept {
  return lacks_spheres(b);
}

/// `why`: missing_data or invalid_input.
template <class Answer>
Answer no_answer(QueryStatus why) noexcept {
  const Eigen::Vector3d none = Eigen::Vector3d::Constant(kNone);
  if constexpr (std::is_same_v<Answer, ContactPatches>) {
    return {no_answer<Penetration>(why)};
  } else if constexpr (std::is_same_v<Answer, OverlapOutline>) {
    return {no_answer<ContactPatches>(why)};
  } else if constexpr (std::is_same_v<Answer, TimeOfImpact>) {
    TimeOfImpact result;
    result.status = why;
    result.time = result.distance_min = result.distance_max = kNone;
    result.point_a = result.point_b = result.normal = none;
    return result;
  } else if constexpr (std::is_same_v<Answer, Penetration>) {
    return {kNone, kNone, kNone, none, none, none, kNone, none, why};
  } else {
    return {kNone, kNone, kNone, none, none, none, why};
  }
}

template <class Answer>
Answer missing_data() noexcept {
  return no_answer<Answer>(QueryStatus::missing_data);
}
template <class Answer>
Answer invalid_input() noexcept {
  return no_answer<Answer>(QueryStatus::invalid_input);
}

/// The answer for solids that are certainly farther apart than the caller's limit.
inline Separation farther_than(double most) noexcept {
  Separation result = no_answer<Separation>(QueryStatus::ok);
  result.distance = result.distance_min = most;
  result.distance_max = std::numeric_limits<double>::infinity();
  return result;
}

}  // namespace ist
