#pragma once

#include <ist/bullet/contacts.h>
#include <ist/time_of_impact.h>
#include <array>
#include <optional>

#include "bullet/partner.h"

namespace ist::bullet {

using Places = std::array<btTransform, 2>;

inline Places operator*(const Places& a, const Places& b) { return {a[0] * b[0], a[1] * b[1]}; }

/// Two shapes of which one is a Shape, prepared for many queries. Both must outlive it.
class Meeting {
 public:
  /// `world`: where to warn.
  Meeting(const btCollisionShape& first, const btCollisionShape& second,
          const Contacts* world = nullptr);

  /// One of them is a Shape.
  bool has_shape() const { return first_ != nullptr || second_ != nullptr; }
  bool is_met() const { return (first_ != nullptr && second_ != nullptr) || partner_.has_value(); }

  /// The shapes' transforms are given. The contact pushes the second. `likely_apart`: looks first
  /// whether the shapes are; it changes no contact.
  void find(const btTransform& first, const btTransform& second, const Settings& settings,
            Contact& contact, bool likely_apart = false) const;

  /// The nearest points of shapes that are apart by no more than `most` [u].
  Separation gap(const btTransform& first, const btTransform& second, const Settings& settings,
                 double most) const;

  /// The asset's spheres leave a layer uncovered that is thick for a partner of this size.
  bool is_coarse() const;

  /// How far two bodies get until their shapes collide, or get too deep in a contact: see
  /// Contacts::updateAction(). `in_body`: the shapes, as children of these. All of the motion if no
  /// point moves by more than `threshold` [u] against the other body.
  Passage passage(const Places& from, const Places& to, const Places& in_body, double threshold,
                  const Settings& settings) const;

  /// [u] No point of one has moved by more than this against the other since the second was at
  /// `before` in the frame of the first.
  double largest_motion(const btTransform& before, const btTransform& now) const;

  double volume() const;     ///< [u³] of the smaller asset
  double stiffness() const;  ///< [force/u³] of the shapes' materials; 0: none has any

 private:
  using Solids = std::array<PlacedSolid, 2>;
  double thickness_of(const Settings& settings) const;  ///< [u] Settings::thickness, or its default
  /// For overlapping solids: whether one is wholly inside the other, and then the shortest way out.
  bool find_way_out(const Solids& solids, const Places& at, Contact& contact) const;
  /// At the beginning of a motion.
  Solids placed(const Places& from, const Places& to, const Settings& settings) const;
  /// The first impact of a motion of both bodies in a time of 1.
  TimeOfImpact impact(const Places& from, const Places& to, const Places& in_body,
                      const Settings& settings) const;

  const Shape* first_ = nullptr;  // null: partner_
  const Shape* second_ = nullptr;
  const Contacts* world_;
  std::uint32_t pair_id_;  // no two at a time have the same
  std::optional<Partner> partner_;
};

/// [u] Volume over area; 0 without an overlap.
double mean_depth(const Contact& contact);

/// The motion of an object that is placed anew in every step and given no speed: Bullet's solver
/// does not see it.
struct Unsaid {
  btVector3 velocity{0, 0, 0}, turning{0, 0, 0}, origin{0, 0, 0};
  btVector3 at(const btVector3& point) const { return velocity + turning.cross(point - origin); }
};

/// The spring that pushes two bodies apart.
struct Spring {
  double stiffness = 0;   ///< [force/u³] pressure over depth
  double relaxation = 0;  ///< [s] damper over spring
  double rest = 0;        ///< [u] depth at which the lighter body rests
  double slow = 0;        ///< [u/s] a body that fell by `rest` is this fast
  double linear = 0;      ///< [u] deeper, the pressure grows with the depth's square
  double push_out = 1;    ///< [u/s] it drives bodies apart no faster
  double least = 1;       ///< [u/s] at least, where other points push against it
  double rebound = 0;     ///< of a closing speed that it may give back
  double step = 0;        ///< [s] the world's

  /// Of the same settings and bodies, in steps that may differ.
  bool is_like(const Spring& other) const {
    return stiffness == other.stiffness && relaxation == other.relaxation &&
           push_out == other.push_out;
  }
  /// [force/u³] at that depth.
  double at(double depth) const { return stiffness * std::max(1.0, depth / linear); }
  /// [u/s] At which an implicit step parts bodies at rest that are so deep: the spring's speed, but
  /// no more than `most`.
  double parting(double depth, double most) const {
    return std::min(depth / (step + relaxation), std::max(most, least));
  }
};

/// `step` [s]: the world's.
Spring spring_of(const Meeting& meeting, const btCollisionObject& first,
                 const btCollisionObject& second, const Settings& settings, double step);

}  // namespace ist::bullet
