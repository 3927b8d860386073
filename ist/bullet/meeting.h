#pragma once

#include <ist/bullet/contacts.h>
#include <ist/time_of_impact.h>
#include <array>
#include <optional>

#include "bullet/partner.h"

namespace ist::bullet {

using Places = std::array<btTransform, 2>;

inline Places operator*(const Places& a, const Places& b) { return {a[0] * b[0], a[1] * b[1]}; }

/// Two shapes, at least one of which is a Shape, prepared for many queries. Both must outlive it.
class Meeting {
 public:
  /// `world`: where to warn.
  Meeting(const btCollisionShape& first, const btCollisionShape& second,
          const Contacts* world = nullptr);

  /// True if one of them is a Shape.
  bool has_shape() const { return first_ != nullptr || second_ != nullptr; }
  bool is_met() const { return (first_ != nullptr && second_ != nullptr) || partner_.has_value(); }

  /// Finds the contact at the given transforms; it pushes the second. `likely_apart`: tests first
  /// whether the shapes are apart, which does not change the contact.
  void find(const btTransform& first, const btTransform& second, const Settings& settings,
            Contact& contact, bool likely_apart = false) const;

  /// The nearest points of shapes that are apart by no more than `most` [u].
  Separation gap(const btTransform& first, const btTransform& second, const Settings& settings,
                 double most) const;

  /// True if the asset's spheres leave a layer uncovered that is thick for a partner of this size.
  bool is_coarse() const;

  /// How far two bodies get until their shapes collide, or get too deep in a contact: see
  /// Contacts::updateAction(). `in_body`: the shapes, as children of these. All of the motion if no
  /// point moves by more than `threshold` [u] relative to the other body.
  Passage passage(const Places& from, const Places& to, const Places& in_body, double threshold,
                  const Settings& settings) const;

  /// [u] Bound on the motion of any point of one relative to the other since the second was at
  /// `before` in the frame of the first.
  double largest_motion(const btTransform& before, const btTransform& now) const;

  double volume() const;     ///< [u³] of the smaller asset
  double stiffness() const;  ///< [force/u³] of the shapes' materials; 0: neither has one

 private:
  using Solids = std::array<PlacedSolid, 2>;
  double thickness_of(const Settings& settings) const;  ///< [u] Settings::thickness, or its default
  /// For overlapping solids: true if one is wholly inside the other, with the shortest exit.
  bool find_way_out(const Solids& solids, const Places& at, Contact& contact) const;
  Solids placed(const Places& from, const Places& to, const Settings& settings) const;
  /// The first impact of a motion of both bodies in a time of 1.
  TimeOfImpact impact(const Places& from, const Places& to, const Places& in_body,
                      const Settings& settings) const;

  const Shape* first_ = nullptr;  // null: partner_
  const Shape* second_ = nullptr;
  const Contacts* world_;
  std::uint32_t pair_id_;  // unique among current pairs
  std::optional<Partner> partner_;
};

/// [u] Volume over area; 0 without an overlap.
double mean_depth(const Contact& contact);

/// The motion of an object that is placed anew in every step without a speed: Bullet's solver does
/// not know it.
struct Unsaid {
  btVector3 velocity{0, 0, 0}, turning{0, 0, 0}, origin{0, 0, 0};
  btVector3 at(const btVector3& point) const { return velocity + turning.cross(point - origin); }
};

/// The spring that pushes two bodies apart.
struct Spring {
  double stiffness = 0;   ///< [force/u³] pressure over depth
  double relaxation = 0;  ///< [s] damper over spring
  double rest = 0;        ///< [u] depth at which the lighter body rests
  double slow = 0;        ///< [u/s] speed of a body that fell by `rest`
  double linear = 0;      ///< [u] beyond it the pressure grows with the square of the depth
  double push_out = 1;    ///< [u/s] maximum separating speed
  double least = 1;       ///< [u/s] minimum, if other points push against it
  double rebound = 0;     ///< of a closing speed that it may return
  double step = 0;        ///< [s] the world's

  /// Of the same settings and bodies, in steps that may differ.
  bool is_like(const Spring& other) const {
    return stiffness == other.stiffness && relaxation == other.relaxation &&
           push_out == other.push_out;
  }
  /// [force/u³] at that depth.
  double at(double depth) const { return stiffness * std::max(1.0, depth / linear); }
  /// [u/s] The speed at which an implicit step separates bodies at rest at that depth: the spring's
  /// speed, but no more than `most`.
  double parting(double depth, double most) const {
    return std::min(depth / (step + relaxation), std::max(most, least));
  }
};

/// `step` [s]: the world's.
Spring spring_of(const Meeting& meeting, const btCollisionObject& first,
                 const btCollisionObject& second, const Settings& settings, double step);

}  // namespace ist::bullet
