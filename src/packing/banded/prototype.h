#pragma once

#include "packing/banded/cell.h"
#include "packing/banded/linear_program.h"
#include "packing/banded/sample.h"

namespace ist::packing {

enum class CellState : std::uint8_t {
  settled,    ///< bound below the margin
  candidate,  ///< prototype's radius reaches the threshold
  split,      ///< neither: subdivide
  open,       ///< not yet known
};

constexpr int kMostPlaneTriangles = 32;  ///< of a convex neighbourhood

/// Memory that a team's lanes share while they process one cell, besides their registers.
template <class Feature>
struct CellScratch {
  SampleMemory sample[2];
  Feature ring[kRingCapacity];            ///< the cell's
  Feature triangle[kMostPlaneTriangles];  ///< of a convex neighbourhood
};

/// Begins work on a cell: copies its ring to the scratch.
template <class Team, class Feature>
IST_HD Cell load_cell(const Team& team, const StoredCell<Feature>& from,
                      CellScratch<Feature>& scratch) {
  team.sync();
  for (int i = team.lane(); i < kRingCapacity; i += Team::kWidth)
    team.memory(scratch.ring)[i] = from.ring[i];
  team.sync();
  return from.cell;
}

/// Stores a cell with the scratch's ring.
template <class Team, class Feature>
IST_HD void store_cell(const Team& team, const Cell& cell, const CellScratch<Feature>& scratch,
                       StoredCell<Feature>& to) {
  team.sync();
  if (team.lane() == 0) to.cell = cell;
  for (int i = team.lane(); i < kRingCapacity; i += Team::kWidth)
    to.ring[i] = team.memory(scratch.ring)[i];
}

/// The part of packing that processes one cell at a time: bounds and ascents, by a team. Const, so
/// any number of teams may share it; each has its own scratch. Surface and Spheres are views.
/// Surface: see MeshSurface. Spheres: count(), reach(), for_near(team, x, visit), see GridSpheres.
template <class Surface, class Spheres>
class PrototypeField {
 public:
  using Feature = typename Surface::Feature;
  using Scratch = CellScratch<Feature>;

  IST_HD PrototypeField(const Surface& surface, const Spheres& spheres)
      : surface_(surface), spheres_(spheres) {}

  /// A cell's bound, and where it is attained, relative to the centre; 0 if not computed.
  struct Bounded {
    Sample sample;  ///< at the centre, of spheres and remembered features
    float bound = 0;
    Float3 y;
  };

  /// Updates the cell's bound and prototype for all spheres. The cell settles below `margin` ≥
  /// threshold; cells with a half-edge above `largest` are only bounded.
  template <class Team>
  IST_HD CellState work(const Team& team, Cell& cell, Scratch& scratch, float threshold,
                        float margin, float largest) const {
    Bounded seen;
    CellState state =
        refresh(team, cell, scratch.ring, &scratch.sample[0], threshold, margin, seen);
    if (state == CellState::open) state = confine(team, cell, scratch, seen, margin, largest);
    if (state == CellState::open) state = climb(team, cell, scratch, threshold);
    return state;
  }

  /// The first part of work(), which uses only spheres and remembered features. Returns `open`,
  /// with the sample, if the other parts must follow. The three parts may be done one after another
  /// or in separate passes over many cells. `at`: scratch memory.
  template <class Team>
  IST_HD CellState refresh(const Team& team, Cell& cell, const Feature* ring, SampleMemory* at,
                           float threshold, float margin, Bounded& seen) const {
    if (cell.radius > 0 && cell.seen < spheres_.count() &&
        sphere_clearance(team, cell.prototype, spheres_) < cell.radius)
      cell.radius = 0;
    cell.seen = spheres_.count();
    if (cell.radius >= threshold) return CellState::candidate;
    seen = settle(team, cell.centre, cell.half, cell.bound, cell.surface_at_least, cell.ring_size,
                  ring, at, margin);
    cell.bound = seen.bound;
    if (cell.bound < margin) return CellState::settled;
    cell.radius = 0;
    return CellState::open;
  }

  /// Restores the sample of refresh() for an open cell of which only `y` was kept.
  template <class Team>
  IST_HD_ONCE Bounded look_again(const Team& team, const Cell& cell, Scratch& scratch,
                                 Float3 y) const {
    const float window = kWindow * cell.half;
    const Sample s =
        sample_spheres(team, cell.centre, spheres_, window, kSpare, &scratch.sample[0]);
    return {look_at_ring(team, cell.centre, window, cell.surface_at_least, cell.ring_size,
                         scratch.ring, s),
            cell.bound, y};
  }

  /// The second part: the centre's side, the surface about it, and the resulting bound. `open` if
  /// an ascent is to start from the cell; until then its prototype stores the point where the bound
  /// is attained, relative to the centre, and its radius the centre's clearance.
  template <class Team>
  IST_HD CellState confine(const Team& team, Cell& cell, Scratch& scratch, Bounded seen,
                           float margin, float largest) const {
    const Float3 x = cell.centre;
    if (!cell.side_known) {
      cell.inside = surface_.inside(team, x);
      cell.side_known = true;
    }
    if (!cell.inside) {
      const float h = cell.half * kSqrt3;
      const auto near = surface_.nearest(team, x, h);
      if (near.found) remember(team, near.feature, cell, scratch);
      cell.surface_at_least = near.distance;
      cell.bound = lowered(cell.bound, h - near.distance);
      if (cell.bound < margin || bounded_by_planes(team, cell, scratch, margin, seen.sample))
        return CellState::settled;
      // Only for cells from which ascents start whatever their size.
      return near.found && near.distance < h && largest >= 1 ? CellState::open : CellState::split;
    }
    const View view = look_at_surface(team, x, {seen.sample, cell.surface_at_least});
    cell.surface_at_least = view.surface_at_least;
    seen.sample = view.sample;
    if (view.found) {
      remember(team, view.feature, cell, scratch);
      seen = bounded(team, cell.half, cell.bound, margin,
                     keep_near(team, kWindow * cell.half, view.sample));
      cell.bound = seen.bound;
      if (cell.bound < margin) return CellState::settled;
    }
    if (bounded_by_planes(team, cell, scratch, margin, seen.sample)) return CellState::settled;
    if (cell.half > largest || seen.sample.size == 0) return CellState::split;
    cell.prototype = seen.y;
    cell.radius = seen.sample.clearance;
    return CellState::open;
  }

  /// The last part: an ascent from the point that attains the cell's bound, if that is certainly
  /// inside and better than the centre. If the centre is outside the solid, the ascent starts just
  /// behind the last remembered surface point: only this reaches walls much thinner than the cell.
  template <class Team>
  IST_HD CellState climb(const Team& team, Cell& cell, Scratch& scratch, float threshold) const {
    SampleMemory* const at = &scratch.sample[0];
    const float clearance = cell.radius;
    cell.radius = 0;
    float trust = cell.half;
    Float3 x = cell.centre;
    View view;
    if (cell.inside) {
      const float window = kWindow * cell.half;
      const Float3 there = x + cell.prototype;
      const float moved_by = norm(cell.prototype);
      bool better = moved_by < 0.99f * cell.surface_at_least;
      if (better) {
        view = look(team, there, window, cell.surface_at_least - moved_by, cell, scratch, at);
        better = view.sample.clearance > clearance;
      }
      if (better)
        x = there;
      else
        view = look(team, x, window, cell.surface_at_least, cell, scratch, at);
    } else {
      const Feature nearest =
          team.memory(scratch.ring)[(cell.ring_next + kRingCapacity - 1) % kRingCapacity];
      const FeatureOffset offset = surface_.offset(nearest, x);
      const Constraint c = constraint_of(offset, sqrtf(offset.range2));
      x = x - (cell.surface_at_least + threshold) * c.gradient;
      if (!surface_.inside(team, x)) return CellState::split;
      trust = threshold;
      view = look(team, x, kWindow * threshold, 0, cell, scratch, at);
    }
    if (!(view.sample.clearance > 0)) return CellState::split;
    ascend(team, x, trust, threshold, cell, scratch, view);
    cell.prototype = x;
    cell.radius = view.sample.clearance;
    return cell.radius >= threshold ? CellState::candidate : CellState::split;
  }

  /// The k-th child of a cell, bounded by the spheres and the features that it inherits. `ring`,
  /// the parent's, is unchanged and is the child's too. `at`: scratch memory.
  template <class Team>
  IST_HD Cell child(const Team& team, const Cell& parent, int k, const Feature* ring,
                    SampleMemory* at, float margin) const {
    Cell child = octant(parent, k);
    child.bound = settle(team, child.centre, child.half, child.bound, child.surface_at_least,
                         child.ring_size, ring, at, margin)
                      .bound;
    if (child.half < kSmallestHalfEdge && child.bound > 0.999f * margin)
      child.bound = 0.999f * margin;
    return child;
  }

 private:
  static constexpr float kSqrt3 = 1.7320510f;  // rounded up
  static constexpr float kWindow = 4;          // × half-edge: 2√3 and a margin
  static constexpr float kHope = 6;
  static constexpr int kSpare = kRingCapacity + 1;
  static constexpr float kSmallestHalfEdge = 0x1p-23f;

  // The steps pass their results by value: the device keeps them in registers.

  struct View {
    Sample sample;
    float surface_at_least = 0;  ///< lower bound of the point's distance to the surface
    bool found = false;          ///< a feature that was closer than everything seen before
    Feature feature{};
  };

  /// Lowers a bound, never raises it, and allows for the field's float errors.
  IST_HD static float lowered(float bound, float to) {
    to = to * (1 + 2e-6f);
    return to < bound ? to : bound;
  }

  IST_HD static SampleMemory* other(Scratch& scratch, const Sample& s) {
    return s.at == &scratch.sample[0] ? &scratch.sample[1] : &scratch.sample[0];
  }

  template <class Team>
  IST_HD static void remember(const Team& team, const Feature& feature, Cell& cell,
                              Scratch& scratch) {
    team.sync();
    if (team.lane() == 0) team.memory(scratch.ring)[cell.ring_next] = feature;
    team.sync();
    cell.ring_next = static_cast<std::uint8_t>((cell.ring_next + 1) % kRingCapacity);
    if (cell.ring_size < kRingCapacity) ++cell.ring_size;
  }

  /// Bounds a cell by the spheres and remembered features alone.
  template <class Team>
  IST_HD_ONCE Bounded settle(const Team& team, Float3 centre, float half, float bound,
                             float surface_at_least, int ring_size, const Feature* ring,
                             SampleMemory* at, float margin) const {
    const float window = kWindow * half;
    Sample s = sample_spheres(team, centre, spheres_, window, kSpare, at);
    bound = lowered(bound, s.clearance + half * kSqrt3);
    if (bound < margin) return {s, bound, {}};
    s = look_at_ring(team, centre, window, surface_at_least, ring_size, ring, s);
    return bounded(team, half, bound, margin, s);
  }

  template <class Team>
  IST_HD static Bounded bounded(const Team& team, float half, float bound, float margin,
                                const Sample& s) {
    bound = lowered(bound, s.clearance + half * kSqrt3);
    if (bound < margin || s.size == 0) return {s, bound, {}};
    const ClearanceOptimum best = maximise_clearance(team, s.at, s.size, half, 3 * half * half);
    return {s, lowered(bound, best.value), best.y};
  }

  template <class Team>
  IST_HD bool bounded_by_planes(const Team& team, Cell& cell, Scratch& scratch, float margin,
                                const Sample& s) const {
    if (cell.surface_at_least > cell.half) return false;
    const int planes = surface_.convex_planes(team, cell.centre, cell.half * kSqrt3, cell.inside,
                                              scratch.triangle, kMostPlaneTriangles, s.at, s.size);
    if (planes == 0) return false;
    cell.bound = lowered(cell.bound, maximise_clearance(team, s.at, s.size + planes, cell.half,
                                                        3 * cell.half * cell.half)
                                         .value);
    return cell.bound < margin;
  }

  template <class Team>
  IST_HD_ONCE Sample look_at_ring(const Team& team, Float3 x, float window, float surface_at_least,
                                  int ring_size, const Feature* ring, Sample s) const {
    if (surface_at_least > s.clearance + window || ring_size == 0) return s;
    ring = team.memory(ring);
    constexpr int kMost = (kRingCapacity + Team::kWidth - 1) / Team::kWidth;
    FeatureOffset offset[kMost];
    float range[kMost];
    float nearest = kFarAway;
    IST_ROLLED for (int k = 0; k < kMost; ++k) {
      const int i = k * Team::kWidth + team.lane();
      range[k] = kFarAway;
      if (i < ring_size) offset[k] = surface_.offset(ring[i], x);
    }
    IST_ROLLED for (int k = 0; k < kMost; ++k) if (k * Team::kWidth + team.lane() < ring_size) {
      range[k] = sqrtf(offset[k].range2);
      const float distance = range[k] - offset[k].radius;
      nearest = distance < nearest ? distance : nearest;
    }
    nearest = team.min(nearest);
    if (nearest < s.clearance) s.clearance = nearest;
    IST_ROLLED for (int k = 0; k < kMost; ++k) {
      const bool near = k * Team::kWidth + team.lane() < ring_size &&
                        range[k] - offset[k].radius <= s.clearance + window;
      int total = 0;
      const int place = s.size + team.exclusive_count(near, total);
      if (near) put(team, s.at, place, constraint_of(offset[k], range[k]));
      s.size += total;
    }
    team.sync();
    return s;
  }

  /// Searches the surface for features closer than everything found from x.
  template <class Team>
  IST_HD View look_at_surface(const Team& team, Float3 x, View view) const {
    view.found = false;
    if (view.surface_at_least >= view.sample.clearance) return view;
    // The search compares squares, so it may return a remembered feature at the very same distance.
    const auto near = surface_.nearest(team, x, view.sample.clearance);
    view.found = near.found && near.distance < view.sample.clearance;
    if (view.found) {
      view.feature = near.feature;
      const FeatureOffset offset = surface_.offset(near.feature, x);
      add(team, constraint_of(offset, sqrtf(offset.range2)), view.sample);
    }
    if (view.sample.clearance > view.surface_at_least)
      view.surface_at_least = view.sample.clearance;
    return view;
  }

  template <class Team>
  IST_HD_ONCE View sample(const Team& team, Float3 x, float window, float surface_at_least,
                          int ring_size, const Scratch& scratch, SampleMemory* at) const {
    View view{sample_spheres(team, x, spheres_, window, kSpare, at), surface_at_least};
    view.sample =
        look_at_ring(team, x, window, surface_at_least, ring_size, scratch.ring, view.sample);
    view = look_at_surface(team, x, view);
    view.sample = keep_near(team, window, view.sample);
    return view;
  }

  /// Samples at x, and remembers the features found.
  template <class Team>
  IST_HD View look(const Team& team, Float3 x, float window, float surface_at_least, Cell& cell,
                   Scratch& scratch, SampleMemory* at) const {
    const View view = sample(team, x, window, surface_at_least, cell.ring_size, scratch, at);
    if (view.found) remember(team, view.feature, cell, scratch);
    return view;
  }

  /// Ascends from x by sequential linear programs in a trust box that never reaches the surface.
  /// The linear model bounds the known features from below, so a step fails only because of others.
  template <class Team>
  IST_HD void ascend(const Team& team, Float3& x, float trust, float threshold, Cell& cell,
                     Scratch& scratch, View& view) const {
    constexpr int kSteps = Surface::kAscentSteps;
    bool far = false;  // seen from the top: the last step gained much
    IST_ROLLED for (int step = 0;
                    (step < kSteps || (far && step < 2 * kSteps)) && view.sample.size > 0; ++step) {
      const Sample& s = view.sample;
      const float reach = 0.5f * s.clearance;
      const float box = trust < reach ? trust : reach;
      const ClearanceOptimum best = maximise_clearance(team, s.at, s.size, box, 0);
      const float predicted = best.value - s.clearance;
      if (!(predicted > 1e-4f * s.clearance)) return;
      if (s.clearance + kHope * predicted < threshold) return;
      const View next =
          look(team, x + best.y, kWindow * box, view.surface_at_least - norm(best.y) * 1.00001f,
               cell, scratch, other(scratch, s));
      const float gain = next.sample.clearance - s.clearance;
      far = gain > 0.1f * s.clearance;
      if (gain > 0.05f * predicted) {
        x = x + best.y;
        view = next;
        trust = 2 * box;
      } else {
        trust = 0.25f * box;
        // The features found there limit the model here.
        view = look(team, x, kWindow * box, view.surface_at_least, cell, scratch, s.at);
      }
    }
  }

  const Surface& surface_;
  const Spheres& spheres_;
};

}  // namespace ist::packing
