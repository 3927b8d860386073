#include "query/exact/exact_octants.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "query/base/smooth_step.h"
#include "query/exact/overlap_formulas.h"

namespace ist {
namespace {

using exact::Point;

/// Of a part's sums: what is less in an octant is left to the others.
constexpr double kOctantRounding = 1e-9;

double length(const Point& v) { return std::sqrt(dot(v, v)); }

/// From 1 at `low` to 0 at twice that, or the other way round.
double falls(double x, double low) { return 1 - smooth_step(x / low - 1); }
double rises(double x, double low) { return smooth_step(x / low - 1); }

/// Moves a share of what one octant has to another.
void move(OctantSums& from, double share, OctantSums& to) {
  const auto give = [&](auto& out, auto& in) {
    const auto part = share * out;
    in = in + part;
    out = share == 1 ? part - part : out - part;
  };
  give(from.six_volumes, to.six_volumes);
  give(from.moment, to.moment);
  give(from.torque, to.torque);
  for (int s = 0; s < 2; ++s) give(from.area[s], to.area[s]);
}

void add(OctantSums& sums, bool of_b, const exact::OctantTerms& terms) {
  sums.six_volumes += terms.six_volumes;
  sums.moment = sums.moment + terms.moment;
  sums.area[of_b] = sums.area[of_b] + terms.area;
  sums.torque = sums.torque + terms.torque;
}

double both_areas(const OctantSums& sums) { return length(sums.area[0]) + length(sums.area[1]); }

/// How far two octants are one: where one is a sliver of the other, or where they are near to each
/// other, as those above and below the middle of a contact that is thin aslant are.
double oneness(const OctantSums& x, const OctantSums& y, double near) {
  const double less = std::min(x.six_volumes, y.six_volumes),
               more = std::max(x.six_volumes, y.six_volumes);
  if (!(less > 0)) return 1;
  const double apart =
      length((1 / (4 * x.six_volumes)) * x.moment - (1 / (4 * y.six_volumes)) * y.moment);
  return std::max(falls(less / more, 1.0 / 64), falls(apart, near));
}

/// Of what is near: a part that is no thicker along an axis is not cut across it.
constexpr double kThin = 1.0 / 8;

/// How far a part is no longer than `length` along an axis.
double shortness(const OctantSums& box, int axis, double length) {
  return falls(box.high[axis] - box.low[axis], length);
}
/// And along all.
double smallness(const OctantSums& box, double length) {
  return std::min(
      {shortness(box, 0, length), shortness(box, 1, length), shortness(box, 2, length)});
}

/// Whether it is longer than that along all.
bool is_large(const OctantSums& box, double near) {
  return shortness(box, 0, near) == 0 && shortness(box, 1, near) == 0 &&
         shortness(box, 2, near) == 0;
}

/// A contact that is not thin is one: there its two surfaces differ. `small`: how far it is one as
/// it is small, or for lack of room.
void join_octants(OctantSums (&octants)[8], double near, double small) {
  const auto join = [&](int k, const auto& share) {
    for (int i = 0; i < 8; ++i)
      if ((i >> k & 1) == 0)
        move(octants[i | 1 << k], share(octants[i], octants[i | 1 << k]), octants[i]);
  };
  for (int k = 0; k < 3; ++k) {
    const double thin = shortness(octants[0], k, kThin * near);
    join(k, [&](const auto&, const auto&) { return thin; });
  }
  for (int k = 0; k < 3; ++k)
    join(k, [&](const auto& x, const auto& y) { return oneness(x, y, near); });
  double different = 0, areas = 0;
  for (const OctantSums& sums : octants) {
    different += length(sums.area[0] + sums.area[1]);
    areas += both_areas(sums);
  }
  const double share = areas > 0 ? std::max(small, rises(different / areas, 0.2)) : 1;
  for (int i = 1; i < 8; ++i) move(octants[i], share, octants[0]);
}

}  // namespace

Point ExactOctants::in_axes(const Point& x) const noexcept {
  return {dot(axis_[0], x), dot(axis_[1], x), dot(axis_[2], x)};
}

ExactOctants::Corner ExactOctants::corner(const OctantSums* octants,
                                          const Point& x) const noexcept {
  const Point from = in_axes(x - octants->centre);
  Corner out = {{from.x, from.y, from.z}, 0};
  for (int k = 0; k < 3; ++k) out.octant |= (out.at[k] >= 0 ? 1 : 0) << k;
  out.octant &= octants->planes;
  return out;
}

/// Where a side goes through a plane, on the side of `from`.
ExactOctants::Corner ExactOctants::between(const Corner& from, const Corner& to,
                                           int plane) noexcept {
  const double t = from.at[plane] / (from.at[plane] - to.at[plane]);
  Corner out = {{0, 0, 0}, from.octant};
  for (int k = 0; k < 3; ++k) {
    if (k != plane) out.at[k] = from.at[k] + t * (to.at[k] - from.at[k]);
    // What has both ends on one side stays there, whatever rounding does.
    const int bit = 1 << k;
    if (k > plane && ((from.octant ^ to.octant) & bit) != 0)
      out.octant = (out.octant & ~bit) | (out.at[k] >= 0 ? bit : 0);
  }
  return out;
}

void ExactOctants::add_triangle(OctantSums* octants, bool of_b, double times, const Corner& p,
                                const Corner& q, const Corner& r) noexcept {
  const int unlike = (p.octant ^ q.octant) | (p.octant ^ r.octant);
  if (unlike == 0) {
    add(octants[p.octant], of_b,
        exact::octant_terms(0.5 * times, (of_b ? 0.5 : -0.5) / 3, p.point(), q.point(), r.point()));
    return;
  }
  const int plane = std::countr_zero(static_cast<unsigned>(unlike)), bit = 1 << plane;
  // One corner is alone on its side.
  const Corner* const corners[3] = {&p, &q, &r};
  const int alone = ((q.octant ^ r.octant) & bit) == 0   ? 0
                    : ((p.octant ^ r.octant) & bit) == 0 ? 1
                                                         : 2;
  const Corner &lone = *corners[alone], &next = *corners[(alone + 1) % 3],
               &other = *corners[(alone + 2) % 3];
  Corner to_next = between(lone, next, plane), to_other = between(lone, other, plane);
  add_triangle(octants, of_b, times, lone, to_next, to_other);
  to_next.octant ^= bit;
  to_other.octant ^= bit;
  add_triangle(octants, of_b, times, to_next, next, other);
  add_triangle(octants, of_b, times, to_next, other, to_other);
}

/// Those of a crossing. Most lie in one octant.
void ExactOctants::add_pieces(const OctantPieces& pieces, std::uint32_t lane,
                              OctantSums* octants) noexcept {
  int octant[6], all = 7, any = 0;
  for (int c = 0; c < 6; ++c) {
    octant[c] = pieces.octant[c][lane] & octants->planes;
    all &= octant[c];
    any |= octant[c];
  }
  const auto lanes = [&](const double(&of)[3][8]) -> Point {
    return {of[0][lane], of[1][lane], of[2][lane]};
  };
  if (all == any) {
    OctantSums& sums = octants[all];
    sums.six_volumes += pieces.sum_six_volumes[lane];
    sums.moment = sums.moment + lanes(pieces.sum_moment);
    for (int s = 0; s < 2; ++s) sums.area[s] = sums.area[s] + lanes(pieces.sum_area[s]);
    sums.torque = sums.torque + lanes(pieces.sum_torque);
    return;
  }
  for (int t = 0; t < OctantPieces::kTriangles; ++t) {
    if (pieces.times[t][lane] == 0) continue;
    const bool of_b = (pieces.of_b[t] >> lane & 1) != 0;
    const int c[3] = {pieces.corner(t, 0, lane), pieces.corner(t, 1, lane),
                      pieces.corner(t, 2, lane)};
    if (octant[c[0]] == octant[c[1]] && octant[c[0]] == octant[c[2]]) {
      add(octants[octant[c[0]]], of_b,
          {pieces.six_volumes[t][lane], lanes(pieces.moment[t]), lanes(pieces.area[t]),
           lanes(pieces.torque[t])});
      continue;
    }
    const auto at = [&](int k) -> Corner {
      const double(&x)[3][8] = pieces.at[c[k]];
      return {{x[0][lane], x[1][lane], x[2][lane]}, octant[c[k]]};
    };
    add_triangle(octants, of_b, pieces.times[t][lane], at(0), at(1), at(2));
  }
}

OctantSums* ExactOctants::octants_of(std::uint32_t element) noexcept {
  const ExactPart& part = scratch_.parts[part_of(element)];
  const std::uint32_t slot = scratch_.parts[part.kept].slot;
  return slot == kNoIndex ? nullptr : &scratch_.octant_sums[8 * slot];
}

/// The boxes of parts, and the planes that cut them: those across which octants are not one anyway.
/// Whether there are any.
bool ExactOctants::find_planes(std::span<ExactPart> parts, double near) noexcept {
  const auto reach = [&](OctantSums& sums, const Point& x) {
    const Point from = in_axes(x - sums.centre);
    for (int k = 0; k < 3; ++k) {
      sums.low[k] = std::min(sums.low[k], from[k]);
      sums.high[k] = std::max(sums.high[k], from[k]);
    }
  };
  // The surface between its curves may reach further than these.
  for (std::uint32_t i = 0; i < out_.crossings; ++i)
    if (OctantSums* const sums = octants_of(i))
      reach(*sums, scratch_.crossings.place_of(i, 0, out_.origin));
  for (Side& own : sides_) {
    for_each_block(own.marks.pierced, own.mesh.level[0].count, [&](std::uint32_t b) {
      const CrossedBlock& crossed = own.marks.blocks[own.marks.place[b]];
      for (std::uint32_t v = 0; v < own.mesh.blocks[b].vertices; ++v)
        if (crossed.inside >> v & 1)
          if (OctantSums* const sums = octants_of(vertex_element(own, crossed, v)))
            reach(*sums, crossed.at(v));
    });
    for_each_block(own.marks.inside, own.mesh.level[0].count, [&](std::uint32_t b) {
      OctantSums* const sums = octants_of(block_element(own, b));
      if (sums == nullptr || is_large(*sums, near)) return;
      const MeshBlock& mesh = own.mesh.blocks[b];
      for (std::uint32_t v = 0; v < mesh.vertices; ++v)
        reach(*sums, place(own, mesh.vertex[v]) - out_.origin);
    });
  }
  bool any = false;
  for (ExactPart& part : parts) {
    if (part.slot == kNoIndex) continue;
    OctantSums& sums = scratch_.octant_sums[8 * part.slot];
    for (int k = 0; k < 3 && smallness(sums, near) < 1; ++k)
      sums.planes |= (shortness(sums, k, kThin * near) < 1 ? 1 : 0) << k;
    if (sums.planes == 0) part.slot = kNoIndex;
    any = any || sums.planes != 0;
  }
  return any;
}

/// The pieces that parts are summed of: see ExactTerms.
void ExactOctants::sum_octants() noexcept {
  OctantView view;
  view.origin = out_.origin;
  std::copy_n(axis_, 3, view.axis);
  OctantPieces pieces;
  for (std::uint32_t first = 0; first < out_.crossings; first += 8) {
    const std::uint32_t count = std::min(8u, out_.crossings - first);
    OctantSums* octants[8] = {};
    bool any = false;
    for (std::uint32_t l = 0; l < count; ++l) {
      octants[l] = octants_of(first + l);
      if (octants[l] == nullptr) continue;
      any = true;
      for (int k = 0; k < 3; ++k) view.centre[k][l] = octants[l]->centre[k];
    }
    if (!any) continue;
    octant_pieces(scratch_.crossings, first, view, pieces);
    for (std::uint32_t l = 0; l < count; ++l)
      if (octants[l] != nullptr) add_pieces(pieces, l, octants[l]);
  }
  for (Side& own : sides_) {
    for_each_block(own.marks.pierced, own.mesh.level[0].count, [&](std::uint32_t b) {
      const CrossedBlock& crossed = own.marks.blocks[own.marks.place[b]];
      std::int8_t whole[kWidth];
      count_triangles(own.mesh.blocks[b], crossed, whole);
      for (std::uint32_t t = 0; t < kWidth; ++t) {
        const std::uint32_t element = whole[t] == 0 ? kNoIndex : triangle_element(own, crossed, t);
        if (element == kNoIndex) continue;
        OctantSums* const octants = octants_of(element);
        if (octants == nullptr) continue;
        const auto at = [&](int k) { return corner(octants, crossed.at(crossed.fan[k][t])); };
        add_triangle(octants, own.is_b, whole[t], at(0), at(1), at(2));
      }
    });
    for_each_block(own.marks.inside, own.mesh.level[0].count, [&](std::uint32_t b) {
      if (OctantSums* const octants = octants_of(block_element(own, b))) sum_block(own, b, octants);
    });
  }
}

/// A block inside as a whole: by its integrals if it lies in one octant.
void ExactOctants::sum_block(const Side& own, std::uint32_t b, OctantSums* octants) noexcept {
  const MeshBlock& mesh = own.mesh.blocks[b];
  Corner vertex[kWidth];
  int all = 7, any = 0;
  for (std::uint32_t v = 0; v < mesh.vertices; ++v) {
    vertex[v] = corner(octants, place(own, mesh.vertex[v]) - out_.origin);
    all &= vertex[v].octant;
    any |= vertex[v].octant;
  }
  if (all == any) {
    const LaneSums found = lane_sums(own, 1, b / kWidth, b % kWidth, out_.origin + octants->centre);
    OctantSums& sums = octants[all];
    sums.six_volumes += found.six_volumes;
    sums.moment = sums.moment + in_axes(found.moment);
    sums.area[own.is_b] = sums.area[own.is_b] + in_axes(found.normal);
    sums.torque = sums.torque + (own.is_b ? 0.5 : -0.5) * in_axes(found.torque);
    return;
  }
  for (std::uint32_t t = 0; t < mesh.triangles; ++t)
    add_triangle(octants, own.is_b, 1, vertex[mesh.corner[0][t]], vertex[mesh.corner[1][t]],
                 vertex[mesh.corner[2][t]]);
}

std::uint32_t ExactOctants::split(std::span<ExactPart> parts, bool by_b, double near,
                                  std::size_t room) noexcept {
  for (int k = 0; k < 3; ++k)
    axis_[k] =
        by_b ? (1 / a_from_b_.scale) * Point{a_from_b_.m[k], a_from_b_.m[3 + k], a_from_b_.m[6 + k]}
             : Point{k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
  std::uint32_t slots = 0, count = 0;
  const double least = out_.sums.volume() / static_cast<double>(room);
  for (std::uint32_t p = 0; p < parts.size(); ++p) {
    ExactPart& part = parts[p];
    // Where the whole is nothing, parts are what sums round.
    if (part.kept != p || part.id == 0 || !(least > 0 && part.sums.volume() > least) ||
        slots == ExactScratch::kMostSplit)
      continue;
    part.slot = slots++;
    OctantSums* const octants = &scratch_.octant_sums[8 * part.slot];
    std::fill_n(octants, 8, OctantSums{});
    octants->centre = part.sums.moment / (24 * part.sums.volume());
  }
  if (slots > 0 && find_planes(parts, near)) sum_octants();
  for (std::uint32_t p = 0; p < parts.size(); ++p) {
    if (parts[p].kept != p) continue;
    const std::uint32_t first = count;
    if (parts[p].slot != kNoIndex)
      count = write_octants(parts[p], falls(parts[p].sums.volume(), least), near, count);
    if (count > first) continue;
    ExactPart& whole = scratch_.octants[count] = parts[p];
    whole.id *= 8;
    whole.kept = count++;
  }
  return count;
}

/// Appends the octants of a part. Returns how many are written then: `first` if they are not those
/// of the part, as where rounding is more than what it has.
std::uint32_t ExactOctants::write_octants(const ExactPart& part, double small, double near,
                                          std::uint32_t first) noexcept {
  const auto in_frame = [&](const Point& v) {
    return v.x * axis_[0] + (v.y * axis_[1] + v.z * axis_[2]);
  };
  OctantSums octants[8];
  std::copy_n(&scratch_.octant_sums[8 * part.slot], 8, octants);
  const Point centre = octants[0].centre;
  join_octants(octants, near, std::max(small, smallness(octants[0], near)));
  ExactSums missing = part.sums;  // but for rounding nothing
  const double volume = part.sums.volume();
  double areas = 0;
  std::uint32_t count = first, largest = first;
  for (std::uint64_t i = 0; i < 8; ++i) {
    const OctantSums& octant = octants[i];
    if (!(octant.six_volumes > kOctantRounding * (6 * volume))) continue;
    ExactPart& found = scratch_.octants[count] = {};
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
    areas += both_areas(octant);
    if (octant.six_volumes > 6 * scratch_.octants[largest].sums.volume()) largest = count;
    ++count;
  }
  const double size = std::sqrt(areas) + length(centre);
  if (!(std::abs(missing.volume()) <= 100 * kOctantRounding * volume &&
        length(missing.moment) <= 2400 * kOctantRounding * (volume * size) &&
        length(missing.force) <= 100 * kOctantRounding * areas &&
        length(missing.torque) <= 100 * kOctantRounding * (areas * size)))
    return first;
  scratch_.octants[largest].sums.add(missing);
  return count;
}

}  // namespace ist
