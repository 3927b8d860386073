#include <ist/raycast.h>
#include <algorithm>

#include "c_api/structs.h"

// Rays and points: each by the function that asks one.

namespace ist::c_api {
namespace {

/// ask(placed, i) for each of `count`; the least of their statuses.
template <class Ask>
ist_status_t ask_each(const ist_placed_t* given, std::size_t count, bool there,
                      const Ask& ask) noexcept {
  PlacedSolid solid;
  ist_status_t status = c_api::read(given, solid);
  if (status == IST_OK && count > 0 && !there) status = IST_NULL_POINTER;
  if (status != IST_OK) return status;
  for (std::size_t i = 0; i < count; ++i) status = std::min(status, ask(solid, i));
  return status;
}

}  // namespace
}  // namespace ist::c_api

using namespace ist::c_api;

ist_status_t ist_raycast(const ist_placed_t* solid, const ist_ray_t* rays, size_t count,
                         ist_ray_hit_t* hits, size_t hit_size) {
  if (hit_size != sizeof(ist_ray_hit_t)) return IST_WRONG_SIZE;
  return ask_each(solid, count, rays != nullptr && hits != nullptr,
                  [&](const auto& placed, std::size_t i) {
                    write(ist::raycast(placed, read(rays[i])), hits[i]);
                    return hits[i].status;
                  });
}

ist_status_t ist_closest_point(const ist_placed_t* solid, const double* points, size_t count,
                               ist_surface_point_t* answers, size_t answer_size) {
  if (answer_size != sizeof(ist_surface_point_t)) return IST_WRONG_SIZE;
  return ask_each(solid, count, points != nullptr && answers != nullptr,
                  [&](const auto& placed, std::size_t i) {
                    const double* const x = points + 3 * i;
                    write(ist::closest_point(placed, {x[0], x[1], x[2]}), answers[i]);
                    return answers[i].status;
                  });
}

ist_status_t ist_contains(const ist_placed_t* solid, const double* points, size_t count,
                          ist_yes_no_t* inside) {
  return ask_each(solid, count, points != nullptr && inside != nullptr,
                  [&](const auto& placed, std::size_t i) {
                    const double* const x = points + 3 * i;
                    const ist::YesNoAnswer found = ist::contains(placed, {x[0], x[1], x[2]});
                    inside[i] = static_cast<ist_yes_no_t>(found.answer);
                    return status_of(found.status);
                  });
}
