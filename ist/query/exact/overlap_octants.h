#pragma once

#include <cmath>
#include <cstdint>

#include "query/base/smooth_step.h"
#include "query/exact/exact_sums.h"
#include "query/exact/octant_joins.h"
#include "query/exact/overlap_formulas.h"
#include "query/exact/overlap_parts.h"

namespace ist {

/// Connected parts of an overlap, divided into the octants around their centroids, on the host and
/// on a GPU.
///
/// Every piece of both surfaces is cut by three planes through the centroid, which add nothing to
/// cones from there: volumes are exact. Pieces change over where they have no area, so the sums are
/// continuous in the pose. An octant's gradient is half of what each of the two surfaces has in it.
/// They agree where a contact is thin. Octants join where they do not. Where a part is thin along
/// an axis, its octants on both sides of the middle are one, and it is not cut there.
///
/// Of `Overlap` it asks besides: map(), A's unit frame from B's; find_octant_pieces(first),
/// pieces() of eight crossings in its view. All of a team together.
template <class Overlap>
class OverlapOctants : public OverlapParts<Overlap> {
  using Parts = OverlapParts<Overlap>;
  using Point = exact::Point;

 public:
  using Parts::Parts;

  /// Divides the kept parts of divide(), along the axes of A or B: those that have a patch's share
  /// of the volume, if there are `room` patches. Returns the number of octants in
  /// PartMemory::octants, whose names are 8 times the part's plus the octant's number. `near`:
  /// octants that are no farther apart are one.
  IST_HD std::uint32_t split(std::uint32_t parts, bool by_b, double near,
                             std::uint32_t room) noexcept {
    const Similarity& map = this->map();
    for (int k = 0; k < 3; ++k)
      axis_[k] = by_b ? (1 / map.scale) * Point{map.m[k], map.m[3 + k], map.m[6 + k]}
                      : Point{k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
    const double least = this->whole().volume() / static_cast<double>(room);
    meet();
    if (leads()) pieces().says = begin_octants(parts, least) && find_planes(parts, near);
    meet();
    if (pieces().says) sum_octants();
    return leads() ? write_all(parts, least, near) : 0;
  }

 private:
  using Parts::lane;
  using Parts::leads;
  using Parts::meet;
  using Parts::memory;
  using Parts::mesh;
  using Parts::pieces;
  using Parts::width;

  /// A point relative to a part's centroid, along the axes of the octants.
  struct Corner {
    double at[3];
    int octant;

    IST_HD Point point() const noexcept { return {at[0], at[1], at[2]}; }
  };

  /// Selects the parts to divide. False if there are none.
  IST_HD bool begin_octants(std::uint32_t parts, double least) noexcept {
    std::uint32_t slots = 0;
    for (std::uint32_t p = 0; p < parts; ++p) {
      ExactPart& part = memory().parts[p];
      // If the whole is 0, parts are rounding.
      if (part.kept != p || part.id == 0 || !(least > 0 && part.sums.volume() > least) ||
          slots == PartMemory::kMostSplit)
        continue;
      part.slot = slots++;
      OctantSums* const octants = &memory().octant_sums[8 * part.slot];
      for (int i = 0; i < 8; ++i) octants[i] = OctantSums{};
      octants->centre = part.sums.moment / (24 * part.sums.volume());
    }
    return slots > 0;
  }

  IST_HD std::uint32_t write_all(std::uint32_t parts, double least, double near) noexcept {
    std::uint32_t count = 0;
    for (std::uint32_t p = 0; p < parts; ++p) {
      const ExactPart& part = memory().parts[p];
      if (part.kept != p) continue;
      const std::uint32_t first = count;
      if (part.slot != kNoIndex)
        count = write_octants(part, octants::falls(part.sums.volume(), least), near, count);
      if (count > first) continue;
      ExactPart& whole = memory().octants[count] = part;
      whole.id *= 8;
      whole.kept = count++;
    }
    return count;
  }

  IST_HD Point in_axes(const Point& x) const noexcept {
    return {dot(axis_[0], x), dot(axis_[1], x), dot(axis_[2], x)};
  }

  /// The point where an edge crosses a plane, taken on the side of `from`.
  IST_HD static Corner between(const Corner& from, const Corner& to, int plane) noexcept {
    const double t = from.at[plane] / (from.at[plane] - to.at[plane]);
    Corner out = {{0, 0, 0}, from.octant};
    for (int k = 0; k < 3; ++k) {
      if (k != plane) out.at[k] = from.at[k] + t * (to.at[k] - from.at[k]);
      // If both ends are on one side of a plane, so is the point, whatever rounding does.
      const int bit = 1 << k;
      if (k > plane && ((from.octant ^ to.octant) & bit) != 0)
        out.octant = (out.octant & ~bit) | (out.at[k] >= 0 ? bit : 0);
    }
    return out;
  }

  /// Adds a piece that no plane before `kPlane` cuts.
  template <int kPlane = 0>
  IST_HD_COLD static void add_triangle(OctantSums* octants, bool of_b, double times,
                                       const Corner& p, const Corner& q, const Corner& r) noexcept {
    const int unlike = (p.octant ^ q.octant) | (p.octant ^ r.octant);
    if (unlike == 0) {
      octants::add(octants[p.octant], of_b,
                   exact::octant_terms(0.5 * times, (of_b ? 0.5 : -0.5) / 3, p.point(), q.point(),
                                       r.point()));
      return;
    }
    if constexpr (kPlane < 3) {
      constexpr int kBit = 1 << kPlane;
      if ((unlike & kBit) == 0) {
        add_triangle<kPlane + 1>(octants, of_b, times, p, q, r);
        return;
      }
      // One corner is alone on its side.
      const Corner* const corners[3] = {&p, &q, &r};
      const int alone = ((q.octant ^ r.octant) & kBit) == 0   ? 0
                        : ((p.octant ^ r.octant) & kBit) == 0 ? 1
                                                              : 2;
      const Corner &lone = *corners[alone], &next = *corners[(alone + 1) % 3],
                   &other = *corners[(alone + 2) % 3];
      Corner to_next = between(lone, next, kPlane), to_other = between(lone, other, kPlane);
      add_triangle<kPlane + 1>(octants, of_b, times, lone, to_next, to_other);
      to_next.octant ^= kBit;
      to_other.octant ^= kBit;
      add_triangle<kPlane + 1>(octants, of_b, times, to_next, next, other);
      add_triangle<kPlane + 1>(octants, of_b, times, to_next, other, to_other);
    }
  }

  /// Adds the pieces of a crossing. Most are in one octant.
  IST_HD void add_pieces(std::uint32_t l, OctantSums* octants) noexcept {
    const OctantPieces& seen = pieces().octants;
    int all = 7, any = 0;
    for (int c = 0; c < 6; ++c) {
      all &= seen.octant[c][l] & octants->planes;
      any |= seen.octant[c][l] & octants->planes;
    }
    if (all == any) {
      OctantSums& sums = octants[all];
      sums.six_volumes += seen.sum_six_volumes[l];
      sums.moment = sums.moment + of_lane(seen.sum_moment, l);
      for (int s = 0; s < 2; ++s) sums.area[s] = sums.area[s] + of_lane(seen.sum_area[s], l);
      sums.torque = sums.torque + of_lane(seen.sum_torque, l);
      return;
    }
    for (int t = 0; t < OctantPieces::kTriangles; ++t)
      if (seen.times[t][l] != 0)
        add_seen(octants, seen.of_b[t][l] != 0, t, l, seen.corner(t, 0, l), seen.corner(t, 1, l),
                 seen.corner(t, 2, l));
  }

  /// Adds triangle t of lane l, which has these corners.
  IST_HD void add_seen(OctantSums* octants, bool of_b, int t, std::uint32_t l, int p, int q,
                       int r) noexcept {
    const OctantPieces& seen = pieces().octants;
    const int planes = octants->planes;
    const Corner at[3] = {seen_corner(p, l, planes), seen_corner(q, l, planes),
                          seen_corner(r, l, planes)};
    if (at[0].octant == at[1].octant && at[0].octant == at[2].octant)
      octants::add(octants[at[0].octant], of_b,
                   {seen.six_volumes[t][l], of_lane(seen.moment[t], l), of_lane(seen.area[t], l),
                    of_lane(seen.torque[t], l)});
    else
      add_triangle(octants, of_b, seen.times[t][l], at[0], at[1], at[2]);
  }
  IST_HD static Point of_lane(const double (&of)[3][8], std::uint32_t l) noexcept {
    return {of[0][l], of[1][l], of[2][l]};
  }

  IST_HD OctantSums* octants_of(std::uint32_t element) noexcept {
    const ExactPart& part = memory().parts[this->part_of(element)];
    const std::uint32_t slot = memory().parts[part.kept].slot;
    return slot == kNoIndex ? nullptr : &memory().octant_sums[8 * slot];
  }

  /// Finds the boxes of parts, and the planes that cut them: those across which octants are not one
  /// anyway. False if there are none.
  IST_HD bool find_planes(std::uint32_t parts, double near) noexcept {
    const auto reach = [&](OctantSums& sums, const Point& x) {
      const Point from = in_axes(x - sums.centre);
      for (int k = 0; k < 3; ++k) {
        if (from[k] < sums.low[k]) sums.low[k] = from[k];
        if (from[k] > sums.high[k]) sums.high[k] = from[k];
      }
    };
    // The surface between its curves may extend beyond these.
    for (std::uint32_t i = 0; i < this->crossings(); ++i)
      if (OctantSums* const sums = octants_of(i)) reach(*sums, this->place_of(i, 0));
    for (int side = 0; side < 2; ++side) {
      this->for_each_pierced(side, [&](std::uint32_t b) {
        const std::uint32_t r = this->record_of(side, b);
        for_each_bit(this->inside_of(r), [&](std::uint32_t v) {
          if (OctantSums* const sums = octants_of(this->vertex_element(r, v)))
            reach(*sums, this->at(r, v));
        });
      });
      this->for_each_inside(side, [&](std::uint32_t b) {
        OctantSums* const sums = octants_of(this->block_element(side, b));
        if (sums == nullptr || octants::is_large(*sums, near)) return;
        const MeshBlock& block = mesh(side).blocks[b];
        for (std::uint32_t v = 0; v < block.vertices; ++v)
          reach(*sums, this->vertex(side, block.vertex[v]));
      });
    }
    bool any = false;
    for (std::uint32_t p = 0; p < parts; ++p) {
      ExactPart& part = memory().parts[p];
      if (part.slot == kNoIndex) continue;
      OctantSums& sums = memory().octant_sums[8 * part.slot];
      sums.planes = octants::planes_of(sums, near);
      if (sums.planes == 0) part.slot = kNoIndex;
      any = any || sums.planes != 0;
    }
    return any;
  }

  /// Sums the pieces of parts (ExactTerms) by octants.
  IST_HD void sum_octants() noexcept {
    meet();
    OctantView& view = pieces().view;
    if (leads()) {
      view.origin = this->origin();
      for (int k = 0; k < 3; ++k) {
        view.axis[k] = axis_[k];
        for (double& x : view.centre[k]) x = 0;
      }
    }
    for (std::uint32_t first = 0; first < this->crossings(); first += 8) {
      const std::uint32_t left = this->crossings() - first, count = left < 8 ? left : 8;
      OctantSums* octants[8] = {};
      if (leads()) {
        pieces().says = false;
        for (std::uint32_t l = 0; l < count; ++l) {
          octants[l] = octants_of(first + l);
          if (octants[l] == nullptr) continue;
          pieces().says = true;
          for (int k = 0; k < 3; ++k) view.centre[k][l] = octants[l]->centre[k];
        }
      }
      meet();
      if (pieces().says) this->find_octant_pieces(first);
      for (std::uint32_t l = 0; l < count; ++l)
        if (octants[l] != nullptr) add_pieces(l, octants[l]);
      meet();
    }
    for (int side = 0; side < 2; ++side) {
      this->for_each_pierced(side, [&](std::uint32_t b) {
        const std::uint32_t r = this->record_of(side, b);
        this->count_triangles(r);
        for (std::uint32_t first = 0; first < mesh(side).blocks[b].triangles; first += 8)
          sum_triangles(side, r, first);
      });
      this->for_each_inside(side, [&](std::uint32_t b) { sum_block(side, b); });
    }
  }

  /// Adds eight triangles of a crossed block: the lanes compute them, one adds them.
  IST_HD void sum_triangles(int side, std::uint32_t r, std::uint32_t first) noexcept {
    const MeshBlock& block = this->block_of(r);
    const std::uint32_t left = block.triangles - first, count = left < 8 ? left : 8;
    OctantPieces& seen = pieces().octants;
    OctantView& view = pieces().view;
    OctantSums* octants[8] = {};
    if (leads()) {
      pieces().says = false;
      for (std::uint32_t l = 0; l < count; ++l) {
        const int whole = pieces().whole[first + l];
        const std::uint32_t element = whole == 0 ? kNoIndex : this->triangle_element(r, first + l);
        octants[l] = element == kNoIndex ? nullptr : octants_of(element);
        seen.times[0][l] = octants[l] == nullptr ? 0 : whole;
        if (octants[l] == nullptr) continue;
        pieces().says = true;
        for (int k = 0; k < 3; ++k) view.centre[k][l] = octants[l]->centre[k];
      }
    }
    meet();
    for (std::uint32_t l = lane(); pieces().says && l < count; l += width()) {
      if (seen.times[0][l] == 0) continue;
      // Corners start at the apex.
      const std::uint32_t apex = this->opposite_edge(r, first + l) + 2;
      Point at[3];
      for (std::uint32_t k = 0; k < 3; ++k)
        at[k] = see(this->at(r, block.corner[(apex + k) % 3][first + l]), k, l);
      const exact::OctantTerms terms = exact::octant_terms(
          0.5 * seen.times[0][l], (side == 1 ? 0.5 : -0.5) / 3, at[0], at[1], at[2]);
      seen.six_volumes[0][l] = terms.six_volumes;
      for (int k = 0; k < 3; ++k) {
        seen.moment[0][k][l] = terms.moment[k];
        seen.area[0][k][l] = terms.area[k];
        seen.torque[0][k][l] = terms.torque[k];
      }
    }
    meet();
    for (std::uint32_t l = 0; l < count; ++l)
      if (octants[l] != nullptr) add_seen(octants[l], side == 1, 0, l, 0, 1, 2);
    meet();
  }

  /// Places the c-th corner of lane l in the frame of its octants.
  IST_HD Point see(const Point& x, std::uint32_t c, std::uint32_t l) noexcept {
    OctantPieces& seen = pieces().octants;
    const OctantView& view = pieces().view;
    const Point from = in_axes(x - Point{view.centre[0][l], view.centre[1][l], view.centre[2][l]});
    int octant = 0;
    for (int k = 0; k < 3; ++k) {
      seen.at[c][k][l] = from[k];
      octant |= (from[k] >= 0 ? 1 : 0) << k;
    }
    seen.octant[c][l] = static_cast<std::uint8_t>(octant);
    return from;
  }
  IST_HD Corner seen_corner(int c, std::uint32_t l, int planes) noexcept {
    const OctantPieces& seen = pieces().octants;
    return {{seen.at[c][0][l], seen.at[c][1][l], seen.at[c][2][l]}, seen.octant[c][l] & planes};
  }

  /// Adds a block that is inside as a whole, by its integrals if it is in one octant.
  IST_HD void sum_block(int side, std::uint32_t b) noexcept {
    const MeshBlock& block = mesh(side).blocks[b];
    OctantSums* octants = nullptr;
    if (leads()) {
      octants = octants_of(this->block_element(side, b));
      pieces().says = octants != nullptr;
      for (int k = 0; octants != nullptr && k < 3; ++k)
        for (double& x : pieces().view.centre[k]) x = octants->centre[k];
    }
    meet();
    // Eight vertices at a time.
    for (std::uint32_t v = lane(); pieces().says && v < block.vertices; v += width())
      see(this->vertex(side, block.vertex[v]), v / 8, v % 8);
    meet();
    if (octants == nullptr) return;
    Corner at[kWidth];
    int all = 7, any = 0;
    for (std::uint32_t v = 0; v < block.vertices; ++v) {
      at[v] = seen_corner(static_cast<int>(v / 8), v % 8, octants->planes);
      all &= at[v].octant;
      any |= at[v].octant;
    }
    if (all == any) {
      const LaneSums found = this->lane_sums(side, b, octants->centre);
      OctantSums& sums = octants[all];
      sums.six_volumes += found.six_volumes;
      sums.moment = sums.moment + in_axes(found.moment);
      sums.area[side] = sums.area[side] + in_axes(found.normal);
      sums.torque = sums.torque + (side == 1 ? 0.5 : -0.5) * in_axes(found.torque);
      return;
    }
    for (std::uint32_t t = 0; t < block.triangles; ++t)
      add_triangle(octants, side == 1, 1, at[block.corner[0][t]], at[block.corner[1][t]],
                   at[block.corner[2][t]]);
  }

  /// Appends the octants of a part. Returns the number written then; `first` if they do not sum to
  /// the part, as where rounding exceeds it.
  IST_HD std::uint32_t write_octants(const ExactPart& part, double small, double near,
                                     std::uint32_t first) noexcept {
    const auto in_frame = [&](const Point& v) {
      return v.x * axis_[0] + (v.y * axis_[1] + v.z * axis_[2]);
    };
    OctantSums* const sums = &memory().octant_sums[8 * part.slot];
    const Point centre = sums->centre;
    const double smallness = octants::smallness(*sums, near);
    octants::join(sums, near, small < smallness ? smallness : small);
    ExactSums missing = part.sums;  // but for rounding nothing
    const double volume = part.sums.volume();
    double areas = 0;
    std::uint32_t count = first, largest = first;
    for (std::uint32_t i = 0; i < 8; ++i) {
      const OctantSums& octant = sums[i];
      if (!(octant.six_volumes > octants::kRounding * (6 * volume))) continue;
      ExactPart& found = memory().octants[count] = ExactPart{};
      found.id = 8 * part.id + i;
      found.kept = count;
      found.sums.six_volumes.add(octant.six_volumes);
      found.sums.moment = in_frame(octant.moment) + (4 * octant.six_volumes) * centre;
      found.sums.force = in_frame(0.5 * (octant.area[1] - octant.area[0]));
      found.sums.torque = in_frame(octant.torque) + cross(centre, found.sums.force);
      missing.six_volumes.add(-octant.six_volumes);
      missing.moment = missing.moment - found.sums.moment;
      missing.force = missing.force - found.sums.force;
      missing.torque = missing.torque - found.sums.torque;
      areas += octants::both_areas(octant);
      if (octant.six_volumes > 6 * memory().octants[largest].sums.volume()) largest = count;
      ++count;
    }
    const double size = std::sqrt(areas) + norm(centre), rounding = 100 * octants::kRounding;
    if (!(std::abs(missing.volume()) <= rounding * volume &&
          norm(missing.moment) <= 24 * rounding * (volume * size) &&
          norm(missing.force) <= rounding * areas &&
          norm(missing.torque) <= rounding * (areas * size)))
      return first;
    memory().octants[largest].sums.add(missing);
    return count;
  }

  Point axis_[3] = {};
};

}  // namespace ist
