#pragma once

#include "base/host_device.h"

// The members of answers, listed once: C structs, Python's columns, the GPU's arrays and
// comparisons go through this list. tests/unit/members_test.cpp fails if an answer has a member
// that is not here.

namespace ist {

/// visit(member of each) for every member that all of `answers` have: answers of queries, their C
/// structs, and columns that name members alike.
template <class Visit, class... Answers>
IST_HD constexpr void for_each_member(const Visit& visit, Answers&... answers) {
#define IST_MEMBER(name) \
  if constexpr ((requires { answers.name; } && ...)) visit(answers.name...)
  IST_MEMBER(id);
  IST_MEMBER(time);
  IST_MEMBER(volume);
  IST_MEMBER(volume_min);
  IST_MEMBER(volume_max);
  IST_MEMBER(centroid);
  IST_MEMBER(contact_area);
  IST_MEMBER(contact_normal);
  IST_MEMBER(distance);
  IST_MEMBER(distance_min);
  IST_MEMBER(distance_max);
  IST_MEMBER(error);
  IST_MEMBER(point_a);
  IST_MEMBER(point_b);
  IST_MEMBER(point);
  IST_MEMBER(normal);
  IST_MEMBER(gradient);
  IST_MEMBER(area);
  IST_MEMBER(depth);
  IST_MEMBER(force);
  IST_MEMBER(torque);
  IST_MEMBER(torsion);
  IST_MEMBER(centre);
  IST_MEMBER(axis);
  IST_MEMBER(radius);
  IST_MEMBER(thickness);
  IST_MEMBER(triangle);
  IST_MEMBER(sphere_a);
  IST_MEMBER(sphere_b);
  IST_MEMBER(kind);
  IST_MEMBER(status);
  IST_MEMBER(node_visits);
  IST_MEMBER(sphere_pairs);
  IST_MEMBER(touching);
  IST_MEMBER(surface_pairs);
#undef IST_MEMBER
}

}  // namespace ist
