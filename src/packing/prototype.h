#pragma once

#include "packing/cell.h"
#include "packing/linear_program.h"
#include "packing/sample.h"

namespace ist::packing {

/// Outcome of working on a cell.
enum class CellState : std::uint8_t {
  settled,    ///< bound below the margin
  candidate,  ///< prototype's radius reaches the threshold
  split,      ///< neither: look closer
};

constexpr int kMostPlaneTriangles = 32;  ///< of a convex neighbourhood

/// What a team needs beside registers while it works on one cell; its lanes share it.
template <class Feature>
struct CellScratch {
  SampleMemory sample[2];
  Feature ring[kRingCapacity];            ///< the cell's
  Feature triangle[kMostPlaneTriangles];  ///< of a convex neighbourhood
};

/// Takes a cell up for work: its ring goes to the scratch.
template <class Team, class Feature>
IST_HD Cell load_cell(const Team& team, const StoredCell<Feature>& from,
                      CellScratch<Feature>& scratch) {
  team.sync();
  for (int i = team.lane(); i < kRingCapacity; i += Team::kWidth) scratch.ring[i] = from.ring[i];
  team.sync();
  return from.cell;
}

/// Stores a cell with the scratch's ring.
template <class Team, class Feature>
IST_HD void store_cell(const Team& team, const Cell& cell, const CellScratch<Feature>& scratch,
                       StoredCell<Feature>& to) {
  team.sync();
  if (team.lane() == 0) to.cell = cell;
  for (int i = team.lane(); i < kRingCapacity; i += Team::kWidth) to.ring[i] = scratch.ring[i];
}

/// The part of packing that works on one cell at a time: bounds and ascents, by a team. Const, so
/// any number of teams may share it; each has its own scratch. Surface and Spheres are views:
///   Surface: see MeshSurface. Spheres: count(), reach(), for_near(team, x, visit), see
///   GridSpheres.
template <class Surface, class Spheres>
class PrototypeField {
 public:
  using Feature = typename Surface::Feature;
  using Scratch = CellScratch<Feature>;

  IST_HD PrototypeField(const Surface& surface, const Spheres& spheres)
      : surface_(surface), spheres_(spheres) {}

  /// Brings the cell's bound and prototype up to date with all spheres. The cell settles below
  /// `margin` ≥ threshold; cells with a half-edge above `largest` are only bounded.
  template <class Team>
  IST_HD CellState work(const Team& team, Cell& cell, Scratch& scratch, float threshold,
                        float margin, float largest) const {
    if (cell.radius > 0 && cell.seen < spheres_.count() &&
        sphere_clearance(team, cell.prototype, spheres_) < cell.radius)
      cell.radius = 0;
    cell.seen = spheres_.count();
    if (cell.radius >= threshold) return CellState::candidate;

    Sample s{&scratch.sample[0], 0, 0};
    Float3 y;
    const float window = kWindow * cell.half;
    if (settles(team, cell, scratch, margin, s, y)) return CellState::settled;
    if (!cell.side_known) {
      cell.inside = surface_.inside(team, cell.centre);
      cell.side_known = true;
    }
    Float3 x = cell.centre;
    float surface_at_least = cell.surface_at_least;
    float trust = cell.half;
    if (cell.inside) {
      if (look_at_surface(team, x, cell.surface_at_least, cell, scratch, s)) {
        keep_near(team, window, s);
        if (bounded(team, cell, margin, s, y)) return CellState::settled;
      }
      if (bounded_by_planes(team, cell, scratch, margin, s)) return CellState::settled;
      if (cell.half > largest || s.size == 0) return CellState::split;
      // Start where the cell's bound is attained, if that is sure to be inside and better.
      surface_at_least = cell.surface_at_least;
      if (norm(y) < 0.99f * surface_at_least) {
        Sample there{other(scratch, s), 0, 0};
        float at_least = surface_at_least - norm(y);
        sample(team, x + y, window, at_least, cell, scratch, there);
        if (there.clearance > s.clearance) {
          x = x + y;
          s = there;
          surface_at_least = at_least;
        }
      }
    } else {
      const float h = cell.half * kSqrt3;
      Feature feature;
      float distance = h;
      const bool found = surface_.nearest(team, x, h, feature, distance);
      if (found) remember(team, feature, cell, scratch);
      cell.surface_at_least = distance;
      lower(cell, h - distance);
      if (cell.bound < margin || bounded_by_planes(team, cell, scratch, margin, s))
        return CellState::settled;
      // Climb from just behind the nearest surface point: the only way into a wall much thinner
      // than the cell. Only for cells that are to be climbed from whatever their size.
      if (!found || !(distance < h) || largest < 1) return CellState::split;
      const FeatureOffset offset = surface_.offset(feature, x);
      const Constraint c = constraint_of(offset, sqrtf(offset.range2));
      x = x - (distance + threshold) * c.gradient;
      if (!surface_.inside(team, x)) return CellState::split;
      surface_at_least = 0;
      trust = threshold;
      sample(team, x, kWindow * threshold, surface_at_least, cell, scratch, s);
    }
    if (!(s.clearance > 0)) return CellState::split;
    ascend(team, x, surface_at_least, trust, threshold, cell, scratch, s);
    cell.prototype = x;
    cell.radius = s.clearance;
    return cell.radius >= threshold ? CellState::candidate : CellState::split;
  }

  /// The k-th child of a cell, bounded by the spheres and the features that it inherits. The
  /// scratch holds the parent's ring, which stays as it is and is the child's too.
  template <class Team>
  IST_HD Cell child(const Team& team, const Cell& parent, int k, Scratch& scratch,
                    float margin) const {
    Cell child = octant(parent, k);
    Sample s{&scratch.sample[0], 0, 0};
    Float3 y;
    settles(team, child, scratch, margin, s, y);
    if (child.half < kSmallestHalfEdge && child.bound > 0.999f * margin)
      child.bound = 0.999f * margin;
    return child;
  }

 private:
  static constexpr float kSqrt3 = 1.7320510f;  // rounded up
  static constexpr float kWindow = 4;          // × half-edge: 2√3 and some
  static constexpr float kHope = 6;
  static constexpr int kSpare = kRingCapacity + 1;
  static constexpr float kSmallestHalfEdge = 0x1p-23f;

  /// The bound only falls; float errors of the field are allowed for.
  IST_HD static void lower(Cell& cell, float bound) {
    bound = bound * (1 + 2e-6f);
    if (bound < cell.bound) cell.bound = bound;
  }

  IST_HD static SampleMemory* other(Scratch& scratch, const Sample& s) {
    return s.at == &scratch.sample[0] ? &scratch.sample[1] : &scratch.sample[0];
  }

  template <class Team>
  IST_HD static void remember(const Team& team, const Feature& feature, Cell& cell,
                              Scratch& scratch) {
    team.sync();
    if (team.lane() == 0) scratch.ring[cell.ring_next] = feature;
    team.sync();
    cell.ring_next = static_cast<std::uint8_t>((cell.ring_next + 1) % kRingCapacity);
    if (cell.ring_size < kRingCapacity) ++cell.ring_size;
  }

  /// Lowers the bound by the spheres and remembered features alone; true if below the margin. `s`
  /// is left with what was seen at the centre, y with where the bound is attained.
  template <class Team>
  IST_HD_ONCE bool settles(const Team& team, Cell& cell, const Scratch& scratch, float margin,
                           Sample& s, Float3& y) const {
    const float window = kWindow * cell.half;
    sample_spheres(team, cell.centre, spheres_, window, kSpare, s);
    lower(cell, s.clearance + cell.half * kSqrt3);
    if (cell.bound < margin) return true;
    look_at_ring(team, cell.centre, window, cell.surface_at_least, cell, scratch, s);
    return bounded(team, cell, margin, s, y);
  }

  template <class Team>
  IST_HD static bool bounded(const Team& team, Cell& cell, float margin, const Sample& s,
                             Float3& y) {
    lower(cell, s.clearance + cell.half * kSqrt3);
    if (cell.bound < margin) return true;
    if (s.size == 0) return false;
    const ClearanceOptimum best =
        maximise_clearance(team, *s.at, s.size, cell.half, 3 * cell.half * cell.half);
    lower(cell, best.value);
    y = best.y;
    return cell.bound < margin;
  }

  template <class Team>
  IST_HD bool bounded_by_planes(const Team& team, Cell& cell, Scratch& scratch, float margin,
                                const Sample& s) const {
    if (cell.surface_at_least > cell.half) return false;
    const int planes = surface_.convex_planes(team, cell.centre, cell.half * kSqrt3, cell.inside,
                                              scratch.triangle, kMostPlaneTriangles, *s.at, s.size);
    if (planes == 0) return false;
    lower(cell,
          maximise_clearance(team, *s.at, s.size + planes, cell.half, 3 * cell.half * cell.half)
              .value);
    return cell.bound < margin;
  }

  template <class Team>
  IST_HD_ONCE void look_at_ring(const Team& team, Float3 x, float window, float surface_at_least,
                                const Cell& cell, const Scratch& scratch, Sample& s) const {
    if (surface_at_least > s.clearance + window || cell.ring_size == 0) return;
    constexpr int kMost = (kRingCapacity + Team::kWidth - 1) / Team::kWidth;
    FeatureOffset offset[kMost];
    float range[kMost];
    float nearest = kFarAway;
    for (int k = 0; k < kMost; ++k) {
      const int i = k * Team::kWidth + team.lane();
      range[k] = kFarAway;
      if (i < cell.ring_size) offset[k] = surface_.offset(scratch.ring[i], x);
    }
    for (int k = 0; k < kMost; ++k)
      if (k * Team::kWidth + team.lane() < cell.ring_size) {
        range[k] = sqrtf(offset[k].range2);
        const float distance = range[k] - offset[k].radius;
        nearest = distance < nearest ? distance : nearest;
      }
    nearest = team.min(nearest);
    if (nearest < s.clearance) s.clearance = nearest;
    for (int k = 0; k < kMost; ++k) {
      const bool near = k * Team::kWidth + team.lane() < cell.ring_size &&
                        range[k] - offset[k].radius <= s.clearance + window;
      int total = 0;
      const int place = s.size + team.exclusive_count(near, total);
      if (near) put(*s.at, place, constraint_of(offset[k], range[k]));
      s.size += total;
    }
    team.sync();
  }

  /// Searches the surface for what is closer than everything seen; true if there is something.
  /// Improves `surface_at_least`, the lower bound of x's distance to the surface.
  template <class Team>
  IST_HD bool look_at_surface(const Team& team, Float3 x, float& surface_at_least, Cell& cell,
                              Scratch& scratch, Sample& s) const {
    if (surface_at_least >= s.clearance) return false;
    Feature feature;
    float distance = s.clearance;
    // The search compares squares: a remembered feature may come back at the very same distance.
    const bool found =
        surface_.nearest(team, x, s.clearance, feature, distance) && distance < s.clearance;
    if (found) {
      remember(team, feature, cell, scratch);
      const FeatureOffset offset = surface_.offset(feature, x);
      add(team, constraint_of(offset, sqrtf(offset.range2)), s);
    }
    if (s.clearance > surface_at_least) surface_at_least = s.clearance;
    return found;
  }

  template <class Team>
  IST_HD_ONCE void sample(const Team& team, Float3 x, float window, float& surface_at_least,
                          Cell& cell, Scratch& scratch, Sample& s) const {
    sample_spheres(team, x, spheres_, window, kSpare, s);
    look_at_ring(team, x, window, surface_at_least, cell, scratch, s);
    look_at_surface(team, x, surface_at_least, cell, scratch, s);
    keep_near(team, window, s);
  }

  /// Climbs from x by sequential linear programs in a trust box that never reaches the surface.
  /// The linear model is a lower bound of the features it knows, so a step fails only over
  /// features it does not.
  template <class Team>
  IST_HD void ascend(const Team& team, Float3& x, float surface_at_least, float trust,
                     float threshold, Cell& cell, Scratch& scratch, Sample& s) const {
    constexpr int kSteps = Surface::kAscentSteps;
    IST_ROLLED for (int step = 0; step < kSteps && s.size > 0; ++step) {
      const float reach = 0.5f * s.clearance;
      const float box = trust < reach ? trust : reach;
      const ClearanceOptimum best = maximise_clearance(team, *s.at, s.size, box, 0);
      const float predicted = best.value - s.clearance;
      if (!(predicted > 1e-4f * s.clearance)) return;
      if (s.clearance + kHope * predicted < threshold) return;
      const Float3 there = x + best.y;
      float at_least = surface_at_least - norm(best.y) * 1.00001f;
      Sample next{other(scratch, s), 0, 0};
      sample(team, there, kWindow * box, at_least, cell, scratch, next);
      const float gain = next.clearance - s.clearance;
      if (gain > 0.05f * predicted) {
        x = there;
        s = next;
        surface_at_least = at_least;
        trust = 2 * box;
      } else {
        trust = 0.25f * box;
        // The features found there warn the model here.
        sample(team, x, kWindow * box, surface_at_least, cell, scratch, s);
      }
    }
  }

  const Surface& surface_;
  const Spheres& spheres_;
};

}  // namespace ist::packing
