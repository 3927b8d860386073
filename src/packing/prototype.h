#pragma once

#include <vector>

#include "packing/cell.h"
#include "packing/linear_program.h"
#include "packing/sphere_grid.h"

namespace ist::packing {

/// The field around a point: its clearance (distance to surface ∪ spheres; ≤ 0 inside a sphere)
/// and the constraints of the features that can matter near it.
struct Sample {
  static constexpr int kCapacity = 64;
  Constraint constraint[kCapacity];
  int size = 0;
  float clearance = 0;

  IST_HD void add(const Constraint& c) {
    if (c.distance < clearance) clearance = c.distance;
    if (size < kCapacity) {
      constraint[size++] = c;
      return;
    }
    // Full: the farthest makes room. Any subset still gives a bound.
    int farthest = 0;
    for (int i = 1; i < kCapacity; ++i)
      if (constraint[i].distance > constraint[farthest].distance) farthest = i;
    if (c.distance < constraint[farthest].distance) constraint[farthest] = c;
  }
};

/// Outcome of working on a cell.
enum class CellState : std::uint8_t {
  settled,    ///< bound below the threshold
  candidate,  ///< prototype's radius reaches the threshold
  split,      ///< neither: look closer
};

/// The part of the packing that works on one cell at a time: bound, ascent. Const, so any number
/// of threads may share it.
template <class Surface>
class PrototypeField {
 public:
  using Cell = packing::Cell<typename Surface::Feature>;

  PrototypeField(const Surface& surface, const std::vector<Sphere>& spheres, const SphereGrid& grid)
      : surface_(surface), spheres_(spheres), grid_(grid) {}

  /// Brings the cell's bound and prototype up to date with all spheres. The cell settles below
  /// `margin` ≥ threshold; cells with a half-edge above `largest` are only bounded.
  CellState work(Cell& cell, float threshold, float margin, float largest) const {
    const auto count = static_cast<std::uint32_t>(spheres_.size());
    if (cell.radius > 0 && cell.seen < count) {
      const float now = clearance_of_spheres(cell.prototype);
      if (now < cell.radius) cell.radius = 0;
    }
    if (cell.radius >= threshold) {
      cell.seen = count;
      return CellState::candidate;
    }
    const float h = cell.half * kSqrt3;
    if (!cell.side_known) {
      cell.inside = surface_.inside(cell.centre);
      cell.side_known = true;
    }
    if (!cell.inside) {
      typename Surface::Feature feature;
      float distance;
      if (!surface_.nearest(cell.centre, h, feature, distance)) {
        cell.bound = 0;
        return CellState::settled;
      }
      cell.ring.push(feature);
      cell.surface_at_least = distance;
      lower(cell, h - distance);
    }
    Sample s;
    sample(cell.centre, cell.inside ? cell.surface_at_least : 1e30f, 4 * cell.half, cell.ring, s,
           cell.surface_at_least);
    cell.seen = count;
    if (cell.inside) lower(cell, s.clearance + h);
    if (s.size == 0) return CellState::split;
    if (cell.bound < margin) return CellState::settled;
    const ClearanceOptimum best =
        maximise_clearance(s.constraint, s.size, cell.half, 3 * cell.half * cell.half);
    lower(cell, best.value);
    if (cell.bound < margin) return CellState::settled;
    if (cell.half > largest || !cell.inside) return CellState::split;

    // Start where the linear model is greatest, if that is sure to be inside and better.
    Float3 x = cell.centre;
    float surface_at_least = cell.surface_at_least;
    if (norm(best.y) < 0.99f * surface_at_least) {
      Sample there;
      float at_least = surface_at_least - norm(best.y);
      sample(x + best.y, at_least, 4 * cell.half, cell.ring, there, at_least);
      if (there.clearance > s.clearance) {
        x = x + best.y;
        s = there;
        surface_at_least = at_least;
      }
    }
    if (!(s.clearance > 0)) return CellState::split;
    ascend(x, surface_at_least, cell.half, cell.ring, s);
    cell.prototype = x;
    cell.radius = s.clearance;
    return cell.radius >= threshold ? CellState::candidate : CellState::split;
  }

  /// Clearance of a point to the spheres alone, no more than the grid's reach.
  float clearance_of_spheres(Float3 x) const {
    float clearance = grid_.reach();
    grid_.for_near(x, [&](std::uint32_t i) {
      const Sphere& s = spheres_[i];
      const float g = norm(x - Float3{s.x, s.y, s.z}) - s.r;
      if (g < clearance) clearance = g;
    });
    return clearance;
  }

 private:
  static constexpr float kSqrt3 = 1.7320510f;  // rounded up

  /// The bound only falls; float errors of the field are allowed for.
  static void lower(Cell& cell, float bound) {
    bound = bound * (1 + 2e-6f);
    if (bound < cell.bound) cell.bound = bound;
  }

  /// The field at x. `surface_at_least` bounds the distance to the surface from below;
  /// `improved` takes the better bound found. Features further than clearance + window are left
  /// out.
  void sample(Float3 x, float surface_at_least, float window, Ring<typename Surface::Feature>& ring,
              Sample& out, float& improved) const {
    out.size = 0;
    out.clearance = grid_.reach();
    grid_.for_near(x, [&](std::uint32_t i) {
      const Sphere& s = spheres_[i];
      const Constraint c = ball_constraint({s.x, s.y, s.z}, s.r, x);
      if (c.distance < out.clearance + window) out.add(c);
    });
    for (int i = 0; i < ring.size; ++i) out.add(surface_.at(ring.feature[i], x));
    if (surface_at_least < out.clearance) {
      typename Surface::Feature feature;
      float distance;
      if (surface_.nearest(x, out.clearance, feature, distance)) {
        ring.push(feature);
        out.add(surface_.at(feature, x));
        if (distance < out.clearance) out.clearance = distance;
      }
      if (out.clearance > surface_at_least) surface_at_least = out.clearance;
    }
    improved = surface_at_least < 1e29f ? surface_at_least : improved;
    int kept = 0;
    for (int i = 0; i < out.size; ++i)
      if (out.constraint[i].distance < out.clearance + window)
        out.constraint[kept++] = out.constraint[i];
    out.size = kept;
  }

  /// Climbs from x by sequential linear programs in a trust box that never reaches the surface.
  /// The linear model is a lower bound of the features it knows, so a step fails only over
  /// features it does not.
  void ascend(Float3& x, float surface_at_least, float trust, Ring<typename Surface::Feature>& ring,
              Sample& s) const {
    constexpr int kSteps = 8;
    Sample next;
    for (int step = 0; step < kSteps; ++step) {
      const float reach = 0.5f * s.clearance;
      const float box = trust < reach ? trust : reach;
      const ClearanceOptimum best = maximise_clearance(s.constraint, s.size, box, 0);
      const float predicted = best.value - s.clearance;
      if (!(predicted > 1e-4f * s.clearance)) return;
      const Float3 there = x + best.y;
      float at_least = surface_at_least - norm(best.y) * 1.00001f;
      sample(there, at_least, 4 * box, ring, next, at_least);
      const float gain = next.clearance - s.clearance;
      if (gain > 0.05f * predicted) {
        x = there;
        s = next;
        surface_at_least = at_least;
        trust = 2 * box;
      } else {
        trust = 0.25f * box;
        // The features found there warn the model here.
        sample(x, surface_at_least, 4 * box, ring, s, surface_at_least);
      }
    }
  }

  const Surface& surface_;
  const std::vector<Sphere>& spheres_;
  const SphereGrid& grid_;
};

}  // namespace ist::packing
