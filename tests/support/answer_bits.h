#pragma once

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstdint>

#include <ist/query.h>
#include <ist/time_of_impact.h>

namespace ist::testing {

/// Hash of the bits of answers: member by member, since padding is arbitrary.
class AnswerBits {
 public:
  AnswerBits() { XXH3_64bits_reset(&state_); }
  void add(double x) { XXH3_64bits_update(&state_, &x, sizeof x); }
  void add(std::uint64_t x) { XXH3_64bits_update(&state_, &x, sizeof x); }
  void add(const Eigen::Vector3d& x) { XXH3_64bits_update(&state_, x.data(), 3 * sizeof(double)); }
  void add(const Penetration& p) {
    for (const double x : {p.volume, p.volume_min, p.volume_max}) add(x);
    add(p.centroid);
    // Hashes are of the volume's gradients, which have the other sign.
    for (const Eigen::Vector3d* const x : {&p.force, &p.torque}) add(Eigen::Vector3d(-*x));
    add(std::uint64_t{p.node_visits} << 32 | p.sphere_pairs);
    add(static_cast<std::uint64_t>(p.status));
  }
  void add(const Separation& s) {
    for (const double x : {s.distance, s.distance_min, s.distance_max}) add(x);
    for (const Eigen::Vector3d* const x : {&s.point_a, &s.point_b, &s.normal}) add(*x);
    add(std::uint64_t{s.node_visits} << 32 | s.sphere_pairs);
    add(static_cast<std::uint64_t>(s.status));
  }
  void add(const TimeOfImpact& t) {
    for (const double x : {t.time, t.distance_min, t.distance_max}) add(x);
    for (const Eigen::Vector3d* const x : {&t.point_a, &t.point_b, &t.normal}) add(*x);
    add(std::uint64_t{t.node_visits} << 32 | t.surface_pairs);
    // The table of hashes has one number for both.
    constexpr std::uint64_t kStatus[] = {0, 4, 5, 6};
    add(t.status == QueryStatus::ok ? static_cast<std::uint64_t>(t.kind)
                                    : kStatus[static_cast<std::uint32_t>(t.status)]);
  }
  void add(const ContactPatch& patch) {
    add(patch.id);
    for (const double x : {patch.volume, patch.area, patch.depth}) add(x);
    for (const Eigen::Vector3d* const x :
         {&patch.centroid, &patch.normal, &patch.force, &patch.torque})
      add(*x);
  }
  std::uint64_t value() const { return XXH3_64bits_digest(&state_); }

 private:
  XXH3_state_t state_;
};

}  // namespace ist::testing
