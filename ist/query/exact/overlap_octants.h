#pragma once

#include <cmath>
#include <cstdint>

#include "base/elementary.h"
#include "query/exact/exact_sums.h"
#include "query/exact/octant_joins.h"
#include "query/exact/overlap_formulas.h"
#include "query/exact/overlap_parts.h"

namespace ist {

/// Connected parts of an overlap, divided into the octants around their centroids, on the host and
/// on a GPU.
///
/// Every piece of both surfaces is cut by three planes through the centroid, which add nothing to
/// cones from there: volumes are exact. Pieces change octants where they have no area, so the sums
/// are continuous in the pose. An octant's gradient is half of each surface's. These agree where a
/// contact is thin; elsewhere octants are joined. If a part is thin along an axis, its octants on
/// both sides of the middle are one, and it is not cut there.
///
/// `Overlap` needs also: map(), A's unit frame from B's; find_octant_pieces(first), pieces() of
/// eight crossings in its view. All of a team call it together.
template <class Overlap>
class OverlapOctants : public OverlapParts<Overlap> {
  using Parts = OverlapParts<Overlap>;
  using Point = exact::Point;
  using Corner = octants::Corner;
  using Cut = octants::Cut;

 public:
  using Parts::Parts;

  /// Divides the kept parts of divide(), along the axes of A or B: those that have a patch's share
  /// of the volume, if there are `wanted` patches. Returns the number of octants in
  /// PartMemory::octants, whose names are 8 times the part's plus the octant's number. `near`:
  /// octants that are no farther apart are one.
  IST_HD std::uint32_t split(std::uint32_t parts, bool by_b, double near,
                             std::uint32_t wanted) noexcept {
    const Similarity& map = this->map();
    for (int k = 0; k < 3; ++k)
      axis_[k] = by_b ? (1 / map.scale) * Point{map.m[k], map.m[3 + k], map.m[6 + k]}
                      : Point{k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
    const double least = this->whole().volume() / static_cast<double>(wanted);
    meet();
    if (leads()) pieces().says = begin_octants(parts, least);
    meet();
    bool any = pieces().says;
    if (any) any = this->any(find_planes(parts, near));
    if (any) sum_octants();
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

  /// Adds a triangle piece by piece. No plane before `kPlane` cuts it.
  template <int kPlane = 0>
  IST_HD_COLD static void add_pieces_of(OctantSums* octants, bool of_b, double times,
                                        const Corner& p, const Corner& q,
                                        const Corner& r) noexcept {
    if (are_alike(p, q, r, 7)) {
      octants::add(octants[p.octant], of_b, terms_of(of_b, times, p, q, r));
      return;
    }
    if constexpr (kPlane < 3) {
      if (are_alike(p, q, r, 1 << kPlane)) {
        add_pieces_of<kPlane + 1>(octants, of_b, times, p, q, r);
        return;
      }
      const Cut cut(p, q, r, kPlane);
      for (int piece = 0; piece < 3; ++piece)
        add_pieces_of<kPlane + 1>(octants, of_b, times, cut.corner(piece, 0), cut.corner(piece, 1),
                                  cut.corner(piece, 2));
    }
  }
  /// The same by a team: each lane finds a piece, and each adds one of the numbers.
  IST_HD void add_cut(OctantSums* octants, bool of_b, double times,
                      const Corner (&at)[3]) noexcept {
    static_assert(Parts::width() >= CutPieces::kMost);
    CutPieces& cut = pieces().cut;
    Corner piece[3] = {at[0], at[1], at[2]};
    const bool exists = lane() < CutPieces::kMost && find_piece(lane(), piece);
    int count = 0;
    const int place = this->exclusive_count(exists, count);
    if (exists) {
      const exact::OctantTerms terms = terms_of(of_b, times, piece[0], piece[1], piece[2]);
      cut.octant[place] = static_cast<std::uint8_t>(piece[0].octant);
      for (int n = 0; n < OctantPieces::kTerms; ++n) cut.term[place][n] = octants::term(terms, n);
    }
    meet();
    for (std::uint32_t n = lane(); n < OctantSums::kNumbers; n += width())
      for (int p = 0; p < count; ++p)
        octants::add_number(octants[cut.octant[p]], n, of_b,
                            [&](std::uint32_t k) { return cut.term[p][k]; });
    meet();
  }
  /// Sets lane l of the view to the part of an element, or to none if it is kNoIndex. False if
  /// that part is not divided.
  IST_HD bool look(std::uint32_t l, std::uint32_t element) noexcept {
    OctantView& view = pieces().view;
    view.slot[l] = element == kNoIndex ? kNoIndex : slot_of(element);
    if (view.slot[l] == kNoIndex) return false;
    const OctantSums& first = memory().octant_sums[8 * view.slot[l]];
    view.planes[l] = first.planes;
    for (int k = 0; k < 3; ++k) view.centre[k][l] = first.centre[k];
    return true;
  }
  IST_HD OctantSums* octants_seen(std::uint32_t l) noexcept {
    const std::uint32_t slot = pieces().view.slot[l];
    return slot == kNoIndex ? nullptr : &memory().octant_sums[8 * slot];
  }

  /// Adds the pieces of a crossing. Most are in one octant.
  IST_HD void add_pieces(std::uint32_t l) noexcept {
    OctantSums* const octants = octants_seen(l);
    if (octants == nullptr) return;
    const OctantPieces& seen = pieces().octants;
    const int planes = pieces().view.planes[l];
    int all = 7, any = 0;
    for (int c = 0; c < 6; ++c) {
      all &= seen.octant[c][l] & planes;
      any |= seen.octant[c][l] & planes;
    }
    if (all == any) {
      for (std::uint32_t k = lane(); k < OctantSums::kNumbers; k += width())
        octants[all].number(k) += seen.sum[k][l];
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
    const int planes = pieces().view.planes[l];
    const Corner at[3] = {seen_corner(p, l, planes), seen_corner(q, l, planes),
                          seen_corner(r, l, planes)};
    if (at[0].octant == at[1].octant && at[0].octant == at[2].octant)
      for (std::uint32_t n = lane(); n < OctantSums::kNumbers; n += width())
        octants::add_number(octants[at[0].octant], n, of_b,
                            [&](std::uint32_t k) { return seen.term[t][k][l]; });
    else if constexpr (Parts::width() == 1)
      add_pieces_of(octants, of_b, seen.times[t][l], at[0], at[1], at[2]);
    else
      add_cut(octants, of_b, seen.times[t][l], at);
  }

  IST_HD std::uint32_t slot_of(std::uint32_t element) noexcept {
    const std::uint32_t part = this->known_part(element);
    return part == kNoIndex ? kNoIndex : memory().parts[memory().parts[part].kept].slot;
  }

  /// Finds the boxes of parts, and the planes that cut them: those across which octants are not
  /// joined anyway. False if there are none.
  IST_HD bool find_planes(std::uint32_t parts, double near) noexcept {
    const auto reach = [&](std::uint32_t element, const Point& x) {
      const std::uint32_t slot = slot_of(element);
      if (slot == kNoIndex) return;
      OctantSums& sums = memory().octant_sums[8 * slot];
      const Point from = in_axes(x - sums.centre);
      for (int k = 0; k < 3; ++k) {
        this->least(sums.low[k], from[k]);
        this->most(sums.high[k], from[k]);
      }
    };
    // The surface between its curves may extend beyond these.
    for (std::uint32_t i = lane(); i < this->crossings(); i += width())
      reach(i, this->place_of(i, 0));
    for (std::uint32_t r = lane(); r < this->records(); r += width())
      if (this->pierced_of(r) != 0)
        for_each_bit(this->inside_of(r),
                     [&](std::uint32_t v) { reach(this->vertex_element(r, v), this->at(r, v)); });
    meet();
    for (int side = 0; side < 2; ++side)
      this->for_each_of_lane(side, [&](std::uint32_t b) {
        const std::uint32_t element = this->block_element(side, b), slot = slot_of(element);
        if (slot == kNoIndex || is_large(memory().octant_sums[8 * slot], near)) return;
        const MeshBlock& block = mesh(side).blocks[b];
        for (std::uint32_t v = 0; v < block.vertices; ++v)
          reach(element, this->vertex(side, block.vertex[v]));
      });
    meet();
    bool any = false;
    for (std::uint32_t p = 0; leads() && p < parts; ++p) {
      ExactPart& part = memory().parts[p];
      if (part.slot == kNoIndex) continue;
      OctantSums& sums = memory().octant_sums[8 * part.slot];
      sums.planes = octants::planes_of(sums, near);
      if (sums.planes == 0) part.slot = kNoIndex;
      any = any || sums.planes != 0;
    }
    return any;
  }

  /// octants::is_large() of a box that others may be enlarging.
  IST_HD bool is_large(const OctantSums& of, double near) const noexcept {
    OctantSums box;
    for (int k = 0; k < 3; ++k) {
      box.low[k] = this->load(k == 0 ? of.low.x : k == 1 ? of.low.y : of.low.z);
      box.high[k] = this->load(k == 0 ? of.high.x : k == 1 ? of.high.y : of.high.z);
    }
    return octants::is_large(box, near);
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
    meet();
    for (std::uint32_t first = 0; first < this->crossings(); first += 8) {
      const std::uint32_t left = this->crossings() - first, count = left < 8 ? left : 8;
      bool any = false;
      for (std::uint32_t l = lane(); l < count; l += width()) any = look(l, first + l) || any;
      any = this->any(any);
      meet();
      if (any) this->find_octant_pieces(first);
      for (std::uint32_t l = 0; any && l < count; ++l) add_pieces(l);
      meet();
    }
    for (int side = 0; side < 2; ++side) {
      this->for_each_pierced(side, [&](std::uint32_t b) {
        const std::uint32_t r = this->record_of(side, b);
        this->count_triangles(r);
        for (std::uint32_t first = 0; first < mesh(side).blocks[b].triangles; first += 8)
          sum_triangles(side, b, r, first);
      });
      this->for_each_inside(side, [&](std::uint32_t b) { sum_block(side, b); });
    }
  }

  /// Adds eight triangles of block b, which is crossed and has record r, or is inside as a whole
  /// and has none (kNoIndex): then its vertices are seen.
  IST_HD void sum_triangles(int side, std::uint32_t b, std::uint32_t r,
                            std::uint32_t first) noexcept {
    const MeshBlock& block = mesh(side).blocks[b];
    const std::uint32_t left = block.triangles - first, count = left < 8 ? left : 8;
    OctantPieces& seen = pieces().octants;
    bool any = false;
    for (std::uint32_t l = lane(); l < count; l += width()) {
      const std::uint32_t t = first + l;
      const int whole = r == kNoIndex ? 1 : pieces().whole[t];
      if (r != kNoIndex && !look(l, whole == 0 ? kNoIndex : this->triangle_element(r, t))) continue;
      any = true;
      // Corners of a crossed block's triangle start at the apex.
      const std::uint32_t apex = r == kNoIndex ? 0 : this->opposite_edge(r, t) + 2;
      Point at[3];
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t v = block.corner[(apex + k) % 3][t];
        at[k] = r == kNoIndex ? see_again(v, k, l) : see(this->at(r, v), k, l);
      }
      const exact::OctantTerms terms =
          exact::octant_terms(0.5 * whole, (side == 1 ? 0.5 : -0.5) / 3, at[0], at[1], at[2]);
      seen.times[0][l] = whole;
      for (int n = 0; n < OctantPieces::kTerms; ++n) seen.term[0][n][l] = octants::term(terms, n);
    }
    any = this->any(any);
    meet();
    for (std::uint32_t l = 0; any && l < count; ++l)
      if (OctantSums* const octants = octants_seen(l)) add_seen(octants, side == 1, 0, l, 0, 1, 2);
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
  /// The same for a vertex already placed.
  IST_HD Point see_again(std::uint32_t vertex, std::uint32_t c, std::uint32_t l) noexcept {
    OctantPieces& seen = pieces().octants;
    const std::uint32_t of = kVertices + vertex / 8, in = vertex % 8;
    for (int k = 0; k < 3; ++k) seen.at[c][k][l] = seen.at[of][k][in];
    seen.octant[c][l] = seen.octant[of][in];
    return {seen.at[of][0][in], seen.at[of][1][in], seen.at[of][2][in]};
  }
  IST_HD Corner seen_corner(int c, std::uint32_t l, int planes) noexcept {
    const OctantPieces& seen = pieces().octants;
    return {{seen.at[c][0][l], seen.at[c][1][l], seen.at[c][2][l]}, seen.octant[c][l] & planes};
  }

  /// Adds a block that is inside as a whole, by its integrals if it is in one octant.
  IST_HD void sum_block(int side, std::uint32_t b) noexcept {
    const MeshBlock& block = mesh(side).blocks[b];
    const std::uint32_t slot = slot_of(this->block_element(side, b));
    if (slot == kNoIndex) return;
    OctantSums* const octants = &memory().octant_sums[8 * slot];
    for (std::uint32_t l = lane(); l < 8; l += width()) look(l, this->block_element(side, b));
    meet();
    int all = 7, some = 0;
    for (std::uint32_t v = lane(); v < block.vertices; v += width()) {
      see(this->vertex(side, block.vertex[v]), kVertices + v / 8, v % 8);
      all &= pieces().octants.octant[kVertices + v / 8][v % 8];
      some |= pieces().octants.octant[kVertices + v / 8][v % 8];
    }
    meet();
    bool is_cut = false;
    int in = 0;
    for (int bit = 1; bit < 8; bit *= 2) {
      if ((octants->planes & bit) == 0) continue;
      const bool above = this->any((some & bit) != 0), below = this->any((all & bit) == 0);
      is_cut = is_cut || (above && below);
      in |= above ? bit : 0;
    }
    if (is_cut) {
      for (std::uint32_t first = 0; first < block.triangles; first += 8)
        sum_triangles(side, b, kNoIndex, first);
      return;
    }
    if (leads()) {
      const LaneSums found = this->lane_sums(side, b, octants->centre);
      octants::add(octants[in], side == 1,
                   {found.six_volumes, in_axes(found.moment), in_axes(found.normal),
                    (side == 1 ? 0.5 : -0.5) * in_axes(found.torque)});
    }
    meet();
  }

  /// Appends the octants of a part. Returns the new number; `first` if they do not sum to the part,
  /// for example if rounding exceeds it.
  IST_HD std::uint32_t write_octants(const ExactPart& part, double small, double near,
                                     std::uint32_t first) noexcept {
    const auto in_frame = [&](const Point& v) {
      return v.x * axis_[0] + (v.y * axis_[1] + v.z * axis_[2]);
    };
    OctantSums* const sums = &memory().octant_sums[8 * part.slot];
    const Point centre = sums->centre;
    const double smallness = octants::smallness(*sums, near);
    octants::join(sums, near, small < smallness ? smallness : small);
    ExactSums missing = part.sums;  // nothing but rounding
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

  static constexpr std::uint32_t kVertices = 3;  ///< a block's vertices are seen as corners from it
  Point axis_[3] = {};
};

}  // namespace ist
