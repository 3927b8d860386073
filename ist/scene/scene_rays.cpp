#include <ist/scene.h>
#include <algorithm>
#include <cmath>

#include "scene/scene_impl.h"

namespace ist {

SceneHit Scene::raycast(const Ray& ray) const noexcept {
  SceneHit best;
  const Eigen::Vector3d none = Eigen::Vector3d::Constant(NAN);
  if (!ray.origin.allFinite() || !ray.direction.allFinite() || ray.direction.isZero(0) ||
      std::isnan(ray.max_distance) || ray.max_distance <= 0)
    return {0, {NAN, none, none, ~0u, QueryStatus::invalid_input}};
  const Eigen::Vector3d unit = ray.direction.stableNormalized();
  double longest = ray.max_distance;
  const auto enter = [&](const SceneBox& box) {
    double from = 0, to = longest;
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double low = box.low[i] - ray.origin[k], high = box.high[i] - ray.origin[k];
      if (unit[k] == 0) {
        if (low > 0 || high < 0) return false;
        continue;
      }
      const double x = low / unit[k], y = high / unit[k];
      from = std::max(from, std::min(x, y));
      to = std::min(to, std::max(x, y));
    }
    // Rounding must not pass a flat box.
    return from <= to * (1 + 1e-12) + 1e-300;
  };
  const auto visit = [&](std::uint32_t i) {
    const std::uint32_t number = impl_->number_of[i];
    const RayHit hit = ist::raycast(impl_->solid_of(i), ray);
    if (hit.status != QueryStatus::ok || !hit.hit() || !(hit.distance <= longest)) return;
    if (best.hit.hit() && hit.distance == best.hit.distance && number > best.number) return;
    best = {number, hit};
    longest = hit.distance;
  };
  impl_->each_body(enter, visit);
  return best;
}

SceneNearest Scene::nearest(const Eigen::Vector3d& point, double max_distance) const noexcept {
  SceneNearest best;
  const Eigen::Vector3d none = Eigen::Vector3d::Constant(NAN);
  if (!point.allFinite() || std::isnan(max_distance))
    return {0, {NAN, NAN, none, none, ~0u, QueryStatus::invalid_input}};
  double farthest = max_distance;
  const auto enter = [&](const SceneBox& box) {
    Eigen::Vector3d off;
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      off[k] = std::max({0.0, box.low[i] - point[k], point[k] - box.high[i]});
    }
    // A body that contains the point is in a box that contains it.
    return off.stableNorm() <= std::max(farthest, 0.0) * (1 + 1e-9);
  };
  const auto visit = [&](std::uint32_t i) {
    const std::uint32_t number = impl_->number_of[i];
    const SurfacePoint here = closest_point(impl_->solid_of(i), point);
    if (here.status != QueryStatus::ok || !(here.distance <= farthest)) return;
    if (here.distance == best.surface.distance && number > best.number) return;
    best = {number, here};
    farthest = here.distance;
  };
  impl_->each_body(enter, visit);
  return best;
}

std::size_t Scene::in_box(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper,
                          std::span<std::uint32_t> numbers) const noexcept {
  SceneBox box;
  WorldBox{plain(lower), plain(upper)}.write(box.low, box.high);
  std::size_t count = 0;
  const auto visit = [&](std::uint32_t i) {
    if (count < numbers.size()) numbers[count] = impl_->number_of[i];
    ++count;
  };
  for (const std::uint32_t i : impl_->endless) visit(i);
  impl_->still.each_meeting(box, visit);
  impl_->moving.each_meeting(box, visit);
  return count;
}

}  // namespace ist
