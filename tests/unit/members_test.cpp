#include <gtest/gtest.h>

#include <cstddef>

#include <ist/c.h>
#include <ist/lenses.h>
#include <ist/query.h>
#include <ist/raycast.h>
#include <ist/time_of_impact.h>

#include "query/base/members.h"

namespace ist {
namespace {

/// Bytes of the members that all of the answers have.
template <class... Answers>
std::size_t listed_bytes(const Answers&... answers) {
  std::size_t bytes = 0;
  const auto add = [&](const auto& first, const auto&...) { bytes += sizeof first; };
  for_each_member(add, answers...);
  return bytes;
}

/// `others`: bytes of members that are not listed.
template <class Answer>
void expect_all_listed(std::size_t others = 0) {
  const std::size_t end = listed_bytes(Answer{}) + others, unit = alignof(Answer);
  EXPECT_EQ((end + unit - 1) / unit * unit, sizeof(Answer));
}

TEST(Members, AreAllListed) {
  expect_all_listed<Penetration>();
  expect_all_listed<Separation>();
  expect_all_listed<TimeOfImpact>();
  expect_all_listed<ContactPatch>();
  expect_all_listed<RayHit>();
  expect_all_listed<SurfacePoint>();
  expect_all_listed<OverlapLens>();
  expect_all_listed<ist_penetration_t>(sizeof(ist_penetration_t::size));
  expect_all_listed<ist_separation_t>(sizeof(ist_separation_t::size));
  expect_all_listed<ist_impact_t>(sizeof(ist_impact_t::size) + sizeof(ist_impact_t::kind));
}

TEST(Members, OfCAreThoseOfCpp) {
  EXPECT_EQ(listed_bytes(Penetration{}, ist_penetration_t{}), listed_bytes(Penetration{}));
  EXPECT_EQ(listed_bytes(Separation{}, ist_separation_t{}), listed_bytes(Separation{}));
  EXPECT_EQ(listed_bytes(TimeOfImpact{}, ist_impact_t{}), listed_bytes(TimeOfImpact{}));
  EXPECT_EQ(listed_bytes(ContactPatch{}, ist_contact_patch_t{}), listed_bytes(ContactPatch{}));
  EXPECT_EQ(listed_bytes(RayHit{}, ist_ray_hit_t{}), listed_bytes(RayHit{}));
  EXPECT_EQ(listed_bytes(SurfacePoint{}, ist_surface_point_t{}), listed_bytes(SurfacePoint{}));
}

}  // namespace
}  // namespace ist
