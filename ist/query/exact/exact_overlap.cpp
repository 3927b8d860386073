#include "query/exact/exact_overlap.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <utility>

#include "query/exact/crossing_search.h"
#include "query/exact/inside_search.h"
#include "query/exact/mesh_queries.h"
#include "query/exact/no_volume.h"
#include "query/exact/overlap_terms.h"

namespace ist {
namespace {

using exact::kHalfUnit;
using exact::Point;

using exact::length_bound;

void prefetch(const void* from, const void* to) {
  for (auto* line = static_cast<const std::byte*>(from); line < to; line += 64)
    __builtin_prefetch(line);
}

}  // namespace

/// Triangles within this distance count as near, whichever search found them. It is far more than
/// rounding.
double ExactQuery::nearness() const noexcept {
  return 1e-7 * (sides_[0].mesh.extent() + a_from_b_.scale * sides_[1].mesh.extent());
}

void ExactQuery::move_aside() noexcept {
  const MoveAside aside = aside_of(sides_[0].mesh, sides_[1].mesh, a_from_b_);
  search_.aside = aside.by;
  search_.touch = touching_distance(sides_[0].moved + sides_[1].moved, sides_[0].mesh,
                                    sides_[1].mesh, a_from_b_);
  sides_[1].moved += aside.far;
}

Point ExactQuery::place(const Side& side, std::uint32_t vertex) const noexcept {
  const Point x = side.mesh.vertex(vertex);
  return side.is_b ? map_point(a_from_b_, x) : x;
}

void ExactQuery::clear_marks() noexcept {
  for (Side& side : sides_) {
    const std::uint32_t words = (side.mesh.level[0].count + 63) / 64;
    std::fill_n(side.marks.near.get(), words, 0);
    std::fill_n(side.marks.crossed.get(), words, 0);
    std::fill_n(side.marks.pierced.get(), words, 0);
    std::fill_n(side.marks.inside.get(), words, 0);
    std::fill_n(side.marks.shells.get(), (side.mesh.header->shell_count + 63) / 64, 0);
    side.marks.count = 0;
  }
}

/// Sorts by the numbers of blocks, so that the order of sums is that of the meshes.
void ExactQuery::sort_pairs(std::uint32_t count) noexcept {
  if (count < 64) {
    std::sort(scratch_.keys.get(), scratch_.keys.get() + count);
    return;
  }
  constexpr std::uint32_t kDigit = 9;
  for (const Side& side : {sides_[1], sides_[0]}) {
    const auto bits = static_cast<std::uint32_t>(std::bit_width(side.mesh.level[0].count - 1));
    for (std::uint32_t shift = side.is_b ? 0 : 32, end = shift + bits; shift < end;
         shift += kDigit) {
      std::uint32_t ends[(1u << kDigit) + 1] = {};
      const auto digit = [&](std::uint64_t key) {
        return static_cast<std::uint32_t>(key >> shift) & ((1u << kDigit) - 1);
      };
      for (std::uint32_t i = 0; i < count; ++i) ++ends[digit(scratch_.keys[i]) + 1];
      for (std::uint32_t i = 0; i < 1u << kDigit; ++i) ends[i + 1] += ends[i];
      for (std::uint32_t i = 0; i < count; ++i)
        scratch_.other_keys[ends[digit(scratch_.keys[i])]++] = scratch_.keys[i];
      std::swap(scratch_.keys, scratch_.other_keys);
    }
  }
}

CrossedBlock* ExactQuery::make_crossed_block(Side& own, std::uint32_t block) noexcept {
  BlockMarks& marks = own.marks;
  if (has(marks.crossed, block)) return &marks.blocks[marks.place[block]];
  if (marks.count == scratch_.most_crossed) return nullptr;
  set(marks.crossed, block);
  marks.place[block] = marks.count;
  CrossedBlock& made = marks.blocks[marks.count++];
  made.block = block;
  made.inside = 0;
  made.pierced = 0;
  place_fans(place_block(search_, own.is_b, block, scratch_), own.mesh.blocks[block], out_.origin,
             made);
  return &made;
}

bool ExactQuery::add_crossing(std::uint32_t i) noexcept {
  Crossings& crossings = scratch_.crossings;
  CrossedBlock* blocks[2];
  for (int s = 0; s < 2; ++s) {
    const std::uint32_t triangle = crossings.triangle(s, i);
    blocks[s] = make_crossed_block(sides_[s], triangle / kWidth);
    if (blocks[s] == nullptr) return false;
    for (int k = 0; k < 3; ++k)
      crossings.apex(s, k)[i] = blocks[s]->vertex[k][blocks[s]->fan[0][triangle % kWidth]];
  }
  for (int e = 0; e < 2; ++e) {
    const CrossingEnd end = crossings.end_of(i, e);
    CrossedBlock& block = *blocks[end.of_b];
    const bool opposite = opposite_edge(block, end.triangle % kWidth) == end.edge;
    crossings.opposite(e)[i] = opposite ? (end.enters ? 1.0 : -1.0) : 0.0;
    note_piercing(side(end.of_b), block, end, crossings.end(e, Crossings::kT)[i],
                  crossings.end(e, Crossings::kTError)[i]);
  }
  return true;
}

/// Counts that an edge is pierced: its entries and exits, and which comes first.
void ExactQuery::note_piercing(Side& own, CrossedBlock& crossed, const CrossingEnd& end, double t,
                               double t_error) noexcept {
  const std::uint32_t edge = 3 * (end.triangle % kWidth) + end.edge;
  const int sign = end.enters ? 1 : -1;
  if (crossed.pierced >> edge & 1) {
    crossed.sum[edge] = static_cast<std::int8_t>(crossed.sum[edge] + sign);
    double& first = crossed.first_t[edge];
    double& error = crossed.first_error[edge];
    if (std::abs(t - first) <= t_error + error) {  // their order is uncertain
      if (crossed.first[edge] != sign) crossed.first[edge] = 0;
      error = std::max(error + std::abs(t - first), t_error);
      first = std::min(first, t);
    } else if (t < first) {
      first = t;
      error = t_error;
      crossed.first[edge] = static_cast<std::int8_t>(sign);
    }
  } else {
    if (crossed.pierced == 0) {
      set(own.marks.pierced, crossed.block);
      set(own.marks.shells, own.mesh.blocks[crossed.block].shell);
    }
    crossed.pierced |= std::uint64_t{1} << edge;
    crossed.sum[edge] = crossed.first[edge] = static_cast<std::int8_t>(sign);
    crossed.middle[edge] = 0;
    crossed.first_t[edge] = t;
    crossed.first_error[edge] = t_error;
  }
  if (end.from_first) crossed.middle[edge] = static_cast<std::int8_t>(crossed.middle[edge] + sign);
}

void ExactQuery::count_triangles(const MeshBlock& mesh, const CrossedBlock& crossed,
                                 std::int8_t (&whole)[kWidth]) noexcept {
  for (std::uint32_t t = 0; t < kWidth; ++t)
    whole[t] =
        t < mesh.triangles
            ? static_cast<std::int8_t>(middle_of(mesh, crossed, 3 * t + opposite_edge(crossed, t)))
            : std::int8_t{0};
}

void ExactQuery::sum_crossed_block(const Side& own, const CrossedBlock& crossed) noexcept {
  const MeshBlock& mesh = own.mesh.blocks[crossed.block];
  std::int8_t whole[kWidth];
  count_triangles(mesh, crossed, whole);
  for (int h = 0; h < 2; ++h) {
    ExactTerms terms;
    triangle_terms(crossed, whole, h, terms);
    slots_.add_triangles(terms);
  }
}

LaneSums ExactQuery::lane_sums(const Side& own, int level, std::uint32_t i, std::uint32_t lane,
                               const Point& origin) const noexcept {
  const MeshTree::Level& of = own.mesh.level[level];
  return ist::lane_sums(of.boxes[i], of.sums[i], lane, own.is_b ? &a_from_b_ : nullptr, origin);
}

/// Adds all that is below a lane of a box block and inside as a whole.
void ExactQuery::sum_lane(const Side& own, int level, std::uint32_t i, std::uint32_t lane,
                          ExactSums& into) noexcept {
  const LaneSums sums = lane_sums(own, level, i, lane, out_.origin);
  into.six_volumes.add(sums.six_volumes);
  into.moment = into.moment + sums.moment;
  rounding_ += sums.six_volume_rounding;
  add_layer(own, sums.area, sums.width);
}

void ExactQuery::add_layer(const Side& own, double area, double width) noexcept {
  layers_ += moved_layer(own.moved, area, width);
}

/// Bounds the error from blocks at the surface of the other solid, where rounding and deviations
/// change the volume.
void ExactQuery::bound_near(const Side& own) noexcept {
  const std::uint32_t blocks = own.mesh.level[0].count;
  const double scale = own.is_b ? a_from_b_.scale : 1;
  for (std::uint32_t w = 0; w < (blocks + 63) / 64; ++w)
    for (std::uint64_t left = own.marks.near[w]; left != 0; left &= left - 1) {
      const std::uint32_t b = 64 * w + static_cast<std::uint32_t>(std::countr_zero(left));
      const std::uint32_t i = b / kWidth, lane = b % kWidth;
      const BoxBlock& box = own.mesh.level[1].boxes[i];
      double wide = 0;
      for (int k = 0; k < 3; ++k)
        wide += scale * (double{box.high[k][lane]} - double{box.low[k][lane]});
      add_layer(own, scale * scale * own.mesh.level[1].sums[i].area[lane], wide);
    }
}

/// Finds the pairs of blocks, or takes the kept ones, for find_more().
bool ExactQuery::begin_search(std::uint32_t max_visits, std::uint32_t pair_id) noexcept {
  const double tolerance = 2 * (sides_[0].moved + sides_[1].moved);
  const MeshTree &a = sides_[0].mesh, &b = sides_[1].mesh;
  search_.tolerance = static_cast<float>(tolerance * (1 + 1e-6));
  search_.near = static_cast<float>((tolerance + nearness()) * (1 + 1e-6));
  search_.reach = search_.near;
  search_.max_visits = max_visits;
  scratch_.forget(a.hash);
  if (pair_id != 0 && max_visits == 0) {
    kept_ = &scratch_.kept.of(pair_id, a, b, a_from_b_);
    if (scratch_.kept.serves(*kept_, b, tolerance)) {
      serves_ = true;
      return true;
    }
    scratch_.kept.begin(*kept_, a, b, tolerance);
    search_.reach += static_cast<float>(kept_->margin * (1 + 1e-6));
  }
  const BlockPairs pairs = find_block_pairs(search_, scratch_);
  out_.visits = pairs.visits;
  block_pairs_ = pairs.count;
  if (pairs.complete) sort_pairs(pairs.count);
  return pairs.complete;
}

/// Finds crossing triangles in the order of the meshes, as many as fit behind the `first` that
/// remain from before.
CrossingsFound ExactQuery::find_more(std::uint32_t first, std::uint32_t next) noexcept {
  CrossingsFound found = {.complete = false};
  if (serves_) {
    found = find_kept_crossings(search_, *kept_, scratch_);
    if (found.complete) return found;
    serves_ = false;  // they do not all fit into memory
    kept_->margin = 0;
    if (!begin_search(0, 0)) return found;
  }
  if (kept_ != nullptr && kept_->margin > 0) {
    found = find_crossings(search_, first, next, block_pairs_, kept_, scratch_);
    if (found.complete) return found;
    kept_->margin = 0;
  }
  return find_crossings(search_, first, next, block_pairs_, nullptr, scratch_);
}

ExactOverlap ExactQuery::run(std::uint32_t max_visits, std::uint32_t pair_id) noexcept {
  for (const Side& side : sides_)
    if (side.mesh.level[0].count > scratch_.most_blocks) {
      out_.complete = false;
      return out_;
    }
  // Prefetches all of small meshes at once, in reading order, instead of line after line.
  for (const Side& side : sides_)
    if (side.mesh.top == 1) prefetch(side.mesh.level[1].boxes, side.mesh.level[1].boxes + 1);
  for (const Side& side : sides_)
    if (side.mesh.top == 1) prefetch(side.mesh.vertices, side.mesh.level[1].boxes);
  clear_marks();
  out_.complete = begin_search(max_visits, pair_id);
  std::uint32_t left = 0, next = 0;
  bool settled = false;  // of crossings that are no longer stored
  while (out_.complete) {
    const CrossingsFound found = find_more(left, next);
    out_.consistent = found.consistent;
    out_.complete = found.complete && found.consistent;
    if (!out_.complete) break;
    if (out_.crossings == 0 && found.crossings > 0)
      out_.origin = scratch_.crossings.place_of(0, 0, {0, 0, 0});
    for (std::uint32_t i = left; i < found.crossings; ++i) out_.complete &= add_crossing(i);
    out_.crossings += found.crossings - left;
    const bool ends = serves_ || found.next == block_pairs_;
    const std::uint32_t sums_end = ends ? found.crossings : found.crossings / 8 * 8;
    for (std::uint32_t i = 0; i < sums_end; i += 8) {
      ExactTerms terms;
      crossing_terms(scratch_.crossings, i, out_.origin, terms);
      slots_.add_crossings(terms);
    }
    if (ends) {
      left = found.crossings;
      break;
    }
    whole_ = false;
    settled = settled || any_settled(search_, sums_end, scratch_);
    left = found.crossings - sums_end;
    scratch_.crossings.move_to_front(sums_end, left);
    next = found.next;
  }
  if (kept_ != nullptr) {
    kept_->crossings = out_.crossings;
    if (!out_.complete || !whole_) kept_->margin = 0;
  }
  if (!out_.complete) return out_;
  for (Side& side : sides_) find_insides(side);
  for (Side& side : sides_) {
    // Mesh order, which does not depend on the order of discovery.
    for_each_block(side.marks.pierced, side.mesh.level[0].count, [&](std::uint32_t b) {
      sum_crossed_block(side, side.marks.blocks[side.marks.place[b]]);
    });
    for_each_inside(side, side.mesh.top, 0, [&](int level, std::uint32_t i, std::uint32_t lane) {
      sum_lane(side, level, i, lane, out_.sums);
    });
    bound_near(side);
  }
  out_.sums.add(slots_.total());
  out_.error = 1.01 * ((rounding_ + slots_.rounding()) / 6 + layers_) +
               4 * kHalfUnit * std::abs(out_.sums.volume());
  out_.consistent = std::isfinite(out_.error);  // NaN has no bound
  out_.complete = out_.consistent;
  // A volume within the rounding of sums may be 0.
  const double volume = out_.sums.volume();
  if (std::abs(volume) <= 1.01 * (rounding_ + slots_.rounding()) / 6) {
    const bool crosses = settled || any_settled(search_, left, scratch_);
    const SurfaceContact contact =
        crosses ? SurfaceContact{.touching = true}
                : find_contact(search_, block_pairs_, serves_ ? kept_ : nullptr, scratch_);
    const double smaller =
        std::min(sides_[0].mesh.extent(), a_from_b_.scale * sides_[1].mesh.extent());
    if (crosses ? !(volume > 0)
                : contact.touching && has_no_volume(volume, length_bound(out_.sums.force),
                                                    contact.area, search_.touch, smaller)) {
      out_.contact = contact;
      out_.sums.six_volumes = {};
    }
  }
  return out_;
}

void ExactQuery::settle(Side& side, CrossedBlock& crossed) noexcept {
  const MeshBlock& mesh = side.mesh.blocks[crossed.block];
  BlockInsides found(
      mesh, crossed.pierced, [&](std::uint32_t edge) { return int{crossed.sum[edge]}; },
      [&](std::uint32_t edge) { return int{crossed.first[edge]}; });
  for (std::uint32_t v = found.unknown(mesh); v < kWidth; v = found.unknown(mesh))
    found.tell(v, is_inside(side, mesh.vertex[v]));
  crossed.inside = static_cast<std::uint16_t>(found.inside);
}

bool ExactQuery::is_inside(const Side& own, std::uint32_t vertex) const noexcept {
  const MeshTree& other = sides_[own.is_b ? 0 : 1].mesh;
  const MeshOfPair solid = own.is_b ? MeshOfPair{other} : MeshOfPair{other, &a_from_b_, &b_from_a_};
  return ist::is_inside(solid, place(own, vertex), search_.aside);
}

/// Marks the blocks that are inside as a whole, by flooding from blocks with pierced edges and from
/// whole shells.
void ExactQuery::find_insides(Side& own) noexcept {
  BlockMarks& marks = own.marks;
  const MeshTree& mesh = own.mesh;
  std::uint32_t waiting = 0;
  const auto wait = [&](std::uint32_t block) {
    if (has(marks.pierced, block) || has(marks.inside, block)) return;
    set(marks.inside, block);
    scratch_.flood[waiting++] = block;
  };
  for (std::uint32_t c = 0; c < marks.count; ++c) {
    CrossedBlock& crossed = marks.blocks[c];
    if (crossed.pierced == 0) continue;
    settle(own, crossed);
    const MeshBlock& block = mesh.blocks[crossed.block];
    for (std::uint32_t k = 0; k < block.neighbours; ++k) {
      const std::uint32_t entry = mesh.neighbours[block.first_neighbour + k];
      if (crossed.inside >> entry % kWidth & 1) wait(entry / kWidth);
    }
  }
  for (std::uint32_t s = 0; s < mesh.header->shell_count; ++s)
    if (!has(marks.shells, s) && is_inside(own, mesh.blocks[mesh.shells[s].block].vertex[0])) {
      if (out_.crossings == 0 && waiting == 0)
        out_.origin = place(own, mesh.blocks[mesh.shells[s].block].vertex[0]);
      wait(mesh.shells[s].block);
    }
  while (waiting > 0) {
    const MeshBlock& block = mesh.blocks[scratch_.flood[--waiting]];
    for (std::uint32_t k = 0; k < block.neighbours; ++k)
      wait(mesh.neighbours[block.first_neighbour + k] / kWidth);
  }
}

}  // namespace ist
