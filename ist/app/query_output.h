#pragma once

#include <span>
#include <string>

#include <ist/query.h>

#include "app/pose_rows.h"

namespace ist::app {

struct Answer {
  PoseRow row;
  PenetrationAndSeparation result;
  double time_us = 0;     ///< [µs] wall time of this one query
  bool surfaces = false;  ///< the distance is that of surfaces, else of inner spheres

  /// Surfaces alone have no spheres to be apart.
  bool has_distance() const { return result.separation.status != QueryStatus::not_held; }
  /// Of the halves that there are the one that says most.
  QueryStatus status() const {
    const QueryStatus overlap = result.penetration.status, gap = result.separation.status;
    if (!has_distance()) return overlap;
    return overlap == QueryStatus::error_exceeded && gap != QueryStatus::ok
               ? gap
               : std::max(overlap, gap);
  }
  std::uint64_t node_visits() const;
  std::uint64_t sphere_pairs() const;
};

// The columns of docs/user_guide.md (*Query*), 17 digits; other tools read them: new ones only at
// the end.
std::string answers_csv(std::span<const Answer> answers);
std::string answers_json(std::span<const Answer> answers);

/// One answer for a person.
std::string answer_text(const Answer& answer, const PenetrationSettings& settings);

}  // namespace ist::app
