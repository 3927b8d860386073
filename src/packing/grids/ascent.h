#pragma once

#include <functional>

#include "packing/base/certificate.h"
#include "packing/grids/grid_candidate.h"
#include "packing/grids/local_winding.h"
#include "packing/grids/nearest_primitive.h"

namespace ist::packing {

/// How prototypes are placed and converge in a round.
struct AscentSettings {
  GridLayout layout;  ///< of the prototype grid
  std::uint64_t seed = 0;
  std::uint32_t round = 0;
  float smallest = 0;  ///< prototypes that cannot reach this radius are dropped
};

constexpr int kPlacements = 4;  ///< tries to place a prototype in a free part of its cell
constexpr int kAscentSteps = 48;
constexpr float kFirstStep = 0.95f;  ///< ε(0)
constexpr float kCooling = 0.9f;     ///< ε(t + 1) / ε(t)

/// Directions to the features between which a prototype alternates.
class Contacts {
 public:
  /// Drops old directions after a long step; counts directions over 45° apart.
  IST_HD void see(Float3 away) {
    if (seen_ < 1 || (dot(away, a_) < kApart)) {
      if (seen_ < 1) {
        a_ = away;
        seen_ = 1;
      } else if (seen_ < 2 || dot(away, b_) < kApart) {
        if (seen_ < 2) {
          b_ = away;
          seen_ = 2;
        } else if (seen_ < 3 || dot(away, c_) < kApart) {
          if (seen_ < 3) c_ = away;
          seen_ = seen_ < 3 ? 3 : 4;
        }
      }
    }
  }
  IST_HD int count() const { return seen_; }

 private:
  static constexpr float kApart = 0.70710678f;
  Float3 a_, b_, c_;
  int seen_ = 0;
};

IST_HD inline float within(float x, float lo, float hi) { return x < lo ? lo : (x > hi ? hi : x); }

/// Places a prototype at random in its cell and moves it away from the closest point, in shrinking
/// steps (paper, Algorithm 1), confined to the cell. Returns the best point found.
template <class Team>
IST_HD GridCandidate converged_prototype(const Team& team, const GridScene& scene,
                                         const AscentSettings& settings, std::uint32_t cell) {
  const GridLayout& g = settings.layout;
  int i = 0, j = 0, k = 0;
  g.coordinates(cell, i, j, k);
  const Float3 lo = g.low(i, j, k), hi = g.low(i + 1, j + 1, k + 1);
  GridCandidate best;
  best.cell = cell;
  Float3 p;
  NearestPrimitive near;
  bool placed = false;
  for (int attempt = 0; attempt < kPlacements && !placed; ++attempt) {
    const std::uint64_t bits =
        random_bits(settings.seed, settings.round, cell, static_cast<std::uint32_t>(attempt));
    p = {lo.x + g.size * uniform_part(bits, 0), lo.y + g.size * uniform_part(bits, 21),
         lo.z + g.size * uniform_part(bits, 42)};
    if (!inside_solid(team, scene, p)) continue;
    near = nearest_primitive(team, scene, p);
    placed = near.tag != kNoTag && near.distance > 0;
  }
  if (!placed) return best;
  float step = kFirstStep;
  Contacts contacts;
  for (int t = 0;; ++t) {
    if (near.distance > best.radius) {
      best.radius = near.distance;
      best.centre = p;
    }
    if (t == kAscentSteps) break;
    const Clearance clearance = clearance_from(scene, near.tag, p);
    if (2 * t >= kAscentSteps) contacts.see(clearance.away);
    const float length = step * near.distance;
    const Float3 to{within(p.x + length * clearance.away.x, lo.x, hi.x),
                    within(p.y + length * clearance.away.y, lo.y, hi.y),
                    within(p.z + length * clearance.away.z, lo.z, hi.z)};
    if (to.x == p.x && to.y == p.y && to.z == p.z) break;
    p = to;
    step *= kCooling;
    near = nearest_primitive(team, scene, p, near.tag);
  }
  best.contacts = contacts.count();
  if (!(best.radius >= settings.smallest)) best.radius = 0;
  if (best.radius > 0) best.key = grid_key(best.radius, settings.seed, settings.round, cell);
  return best;
}

/// A candidate that no larger one overlaps, and the radius that it may keep, in double.
struct GridWinner {
  GridCandidate candidate;
  double radius = 0;
};

/// Called between pieces of a round's work; false cancels it.
using GoOn = std::function<bool()>;

// The work of a grid packing's rounds is done by host threads (pack_grids.cpp) or a device
// (cuda/packing/grids/device_rounds.h). Both give the same winners and have the same functions:
//
//   build(layout)             the distance grid of that layout, with all spheres so far
//   place_prototypes(layout)  the prototype grid of that layout
//   split_prototypes()        its cells split in 8
//   round(settings, go_on)    std::vector<GridWinner> in any order
//   converged(settings, go_on)  std::vector<GridCandidate>, all that converged, in any order
//   append(spheres)           they count after the next update() or build()
//   update()                  lists, active cells and discrete distances after append()

/// The radius that surface and spheres leave to a candidate, in double (docs/design.md 3.2); 0 if
/// its centre is not in the solid. overlap() checks the other winners of its round.
template <class Team>
IST_HD double certified_clearance(const Team& team, const GridScene& scene,
                                  const GridCandidate& candidate) {
  if (!inside_solid(team, scene, candidate.centre)) return 0;
  const double p[3] = {candidate.centre.x, candidate.centre.y, candidate.centre.z};
  double radius = candidate.radius;
  for_primitives_near(
      team, scene.grid, candidate.centre, [&] { return candidate.radius; },
      [&](std::uint32_t tag) {
        if (distance_to(scene, tag, candidate.centre) > candidate.radius + kSearchMargin) return;
        double gap = 0;
        if ((tag & kTriangleTag) != 0) {
          const Corners t = corners_of(scene, tag & ~kTriangleTag);
          double point[3];
          gap = gap_to_surface(std::sqrt(exact_closest_in(t, p, point)));
        } else {
          gap = gap_to_sphere(candidate.centre, scene.spheres[tag]);
        }
        radius = gap < radius ? gap : radius;
      },
      [] {});
  return team.min(radius);
}

}  // namespace ist::packing
