#pragma once

#include <vector>

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

/// The part of packing that works on one cell at a time: bounds and ascents. Const, so any number
/// of threads may share it.
template <class Surface>
class PrototypeField {
 public:
  using Feature = typename Surface::Feature;
  using Cell = packing::Cell<Feature>;

  PrototypeField(const Surface& surface, const std::vector<Sphere>& spheres, const SphereGrid& grid)
      : surface_(surface), spheres_(spheres), grid_(grid) {}

  /// Brings the cell's bound and prototype up to date with all spheres. The cell settles below
  /// `margin` ≥ threshold; cells with a half-edge above `largest` are only bounded.
  CellState work(Cell& cell, float threshold, float margin, float largest) const {
    const auto count = static_cast<std::uint32_t>(spheres_.size());
    if (cell.radius > 0 && cell.seen < count &&
        sphere_clearance(cell.prototype, spheres_, grid_) < cell.radius)
      cell.radius = 0;
    cell.seen = count;
    if (cell.radius >= threshold) return CellState::candidate;

    Sample s;
    Float3 y;
    const float window = kWindow * cell.half;
    if (settles(cell, margin, s, y)) return CellState::settled;
    if (!cell.side_known) {
      cell.inside = surface_.inside(cell.centre);
      cell.side_known = true;
    }
    if (!cell.inside) {
      const float h = cell.half * kSqrt3;
      Feature feature;
      float distance = h;
      if (surface_.nearest(cell.centre, h, feature, distance)) cell.ring.push(feature);
      cell.surface_at_least = distance;
      lower(cell, h - distance);
      if (cell.bound < margin || bounded_by_planes(cell, margin, s)) return CellState::settled;
      return distance < h && climb_from_surface(cell, feature, distance, threshold, largest)
                 ? CellState::candidate
                 : CellState::split;
    }
    if (look_at_surface(cell.centre, cell.surface_at_least, cell.ring, s)) {
      s.keep_near(window);
      if (bounded(cell, margin, s, y)) return CellState::settled;
    }
    if (bounded_by_planes(cell, margin, s)) return CellState::settled;
    if (cell.half > largest || s.size == 0) return CellState::split;

    // Start where the cell's bound is attained, if that is sure to be inside and
    // better.
    Float3 x = cell.centre;
    float surface_at_least = cell.surface_at_least;
    if (norm(y) < 0.99f * surface_at_least) {
      Sample there;
      float at_least = surface_at_least - norm(y);
      sample(x + y, window, at_least, cell.ring, there);
      if (there.clearance > s.clearance) {
        x = x + y;
        copy(there, s);
        surface_at_least = at_least;
      }
    }
    if (!(s.clearance > 0)) return CellState::split;
    ascend(x, surface_at_least, cell.half, threshold, cell.ring, s);
    cell.prototype = x;
    cell.radius = s.clearance;
    return cell.radius >= threshold ? CellState::candidate : CellState::split;
  }

  /// Lowers the bound by the spheres and remembered features alone; true if below the margin. `s`
  /// is left with what was seen at the centre, y with where the bound is attained.
  bool settles(Cell& cell, float margin, Sample& s, Float3& y) const {
    const float window = kWindow * cell.half;
    sample_spheres(cell.centre, spheres_, grid_, window, kSpare, s);
    lower(cell, s.clearance + cell.half * kSqrt3);
    if (cell.bound < margin) return true;
    look_at_ring(cell.centre, window, cell.surface_at_least, cell.ring, s);
    return bounded(cell, margin, s, y);
  }

 private:
  static constexpr float kSqrt3 = 1.7320510f;  // rounded up
  static constexpr float kWindow = 4;          // × half-edge: 2√3 and some
  static constexpr float kHope = 6;
  static constexpr int kSpare = Ring<Feature>::kCapacity + 1;

  /// The bound only falls; float errors of the field are allowed for.
  static void lower(Cell& cell, float bound) {
    bound = bound * (1 + 2e-6f);
    if (bound < cell.bound) cell.bound = bound;
  }

  static bool bounded(Cell& cell, float margin, const Sample& s, Float3& y) {
    lower(cell, s.clearance + cell.half * kSqrt3);
    if (cell.bound < margin) return true;
    if (s.size == 0) return false;
    const ClearanceOptimum best =
        maximise_clearance(s.constraint, s.size, cell.half, 3 * cell.half * cell.half);
    lower(cell, best.value);
    y = best.y;
    return cell.bound < margin;
  }

  bool bounded_by_planes(Cell& cell, float margin, const Sample& s) const {
    if (cell.surface_at_least > cell.half) return false;
    Sample flat;
    copy(s, flat);
    const int room = Sample::kCapacity - flat.size;
    const int planes = surface_.convex_planes(cell.centre, cell.half * kSqrt3, cell.inside,
                                              flat.constraint + flat.size, room);
    if (planes == 0) return false;
    flat.size += planes;
    lower(
        cell,
        maximise_clearance(flat.constraint, flat.size, cell.half, 3 * cell.half * cell.half).value);
    return cell.bound < margin;
  }

  /// Climbs from just behind the surface point nearest to a centre that lies outside: the only way
  /// into a wall much thinner than the cell. Only for cells that are to be climbed from whatever
  /// their size.
  bool climb_from_surface(Cell& cell, const Feature& feature, float distance, float threshold,
                          float largest) const {
    if (largest < 1) return false;
    Constraint c;
    surface_.constraints(&feature, 1, cell.centre, &c);
    Float3 x = cell.centre - (distance + threshold) * c.gradient;
    if (!surface_.inside(x)) return false;
    Sample s;
    float surface_at_least = 0;
    sample(x, kWindow * threshold, surface_at_least, cell.ring, s);
    if (!(s.clearance > 0)) return false;
    ascend(x, surface_at_least, threshold, threshold, cell.ring, s);
    cell.prototype = x;
    cell.radius = s.clearance;
    return cell.radius >= threshold;
  }

  void look_at_ring(Float3 x, float window, float surface_at_least, const Ring<Feature>& ring,
                    Sample& s) const {
    if (surface_at_least > s.clearance + window || ring.size == 0) return;
    Constraint known[Ring<Feature>::kCapacity];
    surface_.constraints(ring.feature, ring.size, x, known);
    for (int i = 0; i < ring.size; ++i)
      if (known[i].distance <= s.clearance + window) s.add(known[i]);
  }

  /// Searches the surface for what is closer than everything seen; true if there is something.
  /// Improves `surface_at_least`, the lower bound of x's distance to the surface.
  bool look_at_surface(Float3 x, float& surface_at_least, Ring<Feature>& ring, Sample& s) const {
    if (surface_at_least >= s.clearance) return false;
    Feature feature;
    float distance = s.clearance;
    // The search compares squares: a remembered feature may come back at the very same distance.
    const bool found =
        surface_.nearest(x, s.clearance, feature, distance) && distance < s.clearance;
    if (found) {
      ring.push(feature);
      Constraint c;
      surface_.constraints(&feature, 1, x, &c);
      s.add(c);
    }
    if (s.clearance > surface_at_least) surface_at_least = s.clearance;
    return found;
  }

  void sample(Float3 x, float window, float& surface_at_least, Ring<Feature>& ring,
              Sample& s) const {
    sample_spheres(x, spheres_, grid_, window, kSpare, s);
    look_at_ring(x, window, surface_at_least, ring, s);
    look_at_surface(x, surface_at_least, ring, s);
    s.keep_near(window);
  }

  /// Climbs from x by sequential linear programs in a trust box that never reaches the surface.
  /// The linear model is a lower bound of the features it knows, so a step fails only over
  /// features it does not.
  void ascend(Float3& x, float surface_at_least, float trust, float threshold, Ring<Feature>& ring,
              Sample& s) const {
    constexpr int kSteps = 8;
    Sample next;
    for (int step = 0; step < kSteps; ++step) {
      const float reach = 0.5f * s.clearance;
      const float box = trust < reach ? trust : reach;
      const ClearanceOptimum best = maximise_clearance(s.constraint, s.size, box, 0);
      const float predicted = best.value - s.clearance;
      if (!(predicted > 1e-4f * s.clearance)) return;
      if (s.clearance + kHope * predicted < threshold) return;
      const Float3 there = x + best.y;
      float at_least = surface_at_least - norm(best.y) * 1.00001f;
      sample(there, kWindow * box, at_least, ring, next);
      const float gain = next.clearance - s.clearance;
      if (gain > 0.05f * predicted) {
        x = there;
        copy(next, s);
        surface_at_least = at_least;
        trust = 2 * box;
      } else {
        trust = 0.25f * box;
        // The features found there warn the model here.
        sample(x, kWindow * box, surface_at_least, ring, s);
      }
    }
  }

  const Surface& surface_;
  const std::vector<Sphere>& spheres_;
  const SphereGrid& grid_;
};

}  // namespace ist::packing
