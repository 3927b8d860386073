#include "query/exact/mesh_distance.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/exact/mesh_distance.cpp"
#include <hwy/foreach_target.h>

#include "base/bits.h"
#include "query/exact/block_meeting-inl.h"
#include "query/exact/box_gaps-inl.h"
#include "query/exact/mesh_gap.h"
#include "query/exact/mesh_queries.h"
#include "query/exact/orientation.h"
#include "query/exact/placed_mesh-inl.h"
#include "query/exact/triangle_gaps-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

class MeshGapSearch {
  /// Relative to the margin of crossings, since near pairs grow with its square.
  static constexpr double kMargin = 1.2;
  /// A flag of a kept bound: a later step found it, and B's path until then is added.
  static constexpr std::uint64_t kFoundAgain = std::uint64_t{1} << 32;
  /// The number of pairs of triangles that may be pending. Eight are measured in the same time.
  static constexpr std::uint32_t kFew = 4;
  /// Planes in double are tried after this many pairs without a better one.
  static constexpr std::uint32_t kVain = 32;
  /// A block this many times as large as a node is bounded by its triangles, not by its box.
  static constexpr double kMuchLarger = 3;

 public:
  MeshGapSearch(const GapQuestion& asked, Budget& budget, ExactScratch& scratch)
      : asked_(asked),
        a_(asked.a),
        b_(asked.b),
        budget_(budget),
        scratch_(scratch),
        waiting_(scratch.gaps.get()),
        scale_(asked.a_from_b.scale),
        reach_(reach_of(asked.a, asked.b, asked.a_from_b)),
        single_(floats_tell(asked.a, asked.b, scale_, reach_)),
        slack_(gap_slack(reach_)),
        blur_(single_ ? float_gap_blur(reach_) : slack_),
        single_a_(asked.a_from_b, blur_),
        single_b_(asked.b_from_a, blur_ / scale_),
        double_a_(asked.a_from_b, blur_),
        double_b_(asked.b_from_a, blur_ / scale_),
        best_{gap_rounding(reach_)},
        best_planes_{&a_, &b_, asked.a_from_b, asked.b_from_a} {
    look_along(asked.toward);
    scratch.forget(a_.hash);
    scratch.pairs->count = 0;
    most_ = (asked.most + slack_) * (single_ ? 1 : 1 + 2 * kGapsAlike);
    limit_to(std::min(most_, asked.likely + slack_));
  }

  MeshGap run() {
    KeptRing& ring = scratch_.near;
    KeptPairs* const kept = single_ ? asked_.kept : nullptr;
    if (kept != nullptr && kept->nearest != KeptPairs::kNone) {
      add(kept->nearest);
      measure_added();
    }
    if (kept != nullptr && best_.pair != NearestTriangles::kNone && ring.holds(*kept, b_) &&
        nearest_limit_ + kept->moved < kept->horizon) {
      follow(*kept);
    } else {
      if (kept != nullptr) {
        ring.begin(*kept, a_, b_, 0);
        kept->margin *= kMargin;
        if (kept->margin > 0) keep_ = kept;
        look_ahead(2 * kept->margin);
      }
      if (budget_.limited()) {  // a stopped search has an answer
        add(0);
        measure_added();
      }
      search();
      if (best_.pair == NearestTriangles::kNone && asked_.likely < asked_.most) {
        limit_to(most_);
        search();
      }
    }
    // A search that ended early has not visited all that is near.
    const bool whole = !done();
    finish();
    if (kept != nullptr) {
      if (keep_ != nullptr) kept->horizon = limit_;
      kept->nearest = out_.overlap ? KeptPairs::kNone : best_.pair;
      if (!whole || out_.overlap || out_.farther) kept->margin = 0;
    }
    return out_;
  }

 private:
  /// Sets the direction along which extents are compared. `toward`: unit, or zero for the axes of
  /// A.
  void look_along(const exact::Point& toward) {
    toward_ = level_ = toward;
    faces_.reset();
    const bool known = dot(toward, toward) > 0;
    axes_ = known ? axes_along(toward) : GapAxes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    if (!known) return;
    const GapAxes to_a = seen_back(axes_, asked_.b_from_a, scale_);
    single_ ? single_a_.turn(axes_) : double_a_.turn(axes_);
    single_ ? single_b_.turn(to_a) : double_b_.turn(to_a);
  }

  /// Sets the limit beyond which pairs do not matter. Pairs that later steps may bring within it
  /// are kept.
  void limit_to(double distance) {
    nearest_limit_ = distance;
    limit_ = distance + ahead_;
    squared_limit_ = limit_ * limit_;
  }
  void look_ahead(double by) {
    ahead_ = by;
    limit_to(nearest_limit_);
  }

  /// Searches the kept pairs of blocks. Each has a lower bound of its distance when the search
  /// found it. Pairs that may have come near since are measured again and get a new bound, which
  /// includes B's path until then.
  void follow(KeptPairs& kept) {
    KeptRing& ring = scratch_.near;
    look_ahead(kept.step);
    for (std::uint32_t n = 0; n < kept.count && !done(); n += 2) {
      const std::uint64_t bound = ring.pair(kept, n + 1);
      const double least = double{float_of(static_cast<std::uint32_t>(bound))} -
                           ((bound & kFoundAgain) != 0 ? kept.gone : kept.moved);
      if (least > nearest_limit_) continue;
      budget_.grant(1);
      const std::uint64_t blocks = ring.pair(kept, n);
      const double found = measure(static_cast<std::uint32_t>(blocks >> 32),
                                   static_cast<std::uint32_t>(blocks), std::max(0.0, least));
      ring.pair(kept, n + 1) = kept_least(std::min(found, limit_) + kept.gone) | kFoundAgain;
    }
    measure_added();
  }

  /// Depth first, the nearest child on top. The spheres' distance, which prunes most from the
  /// start, is seldom far off.
  void search() {
    size_ = 0;
    push({0, 0, 0, 0, static_cast<std::uint8_t>(a_.top), static_cast<std::uint8_t>(b_.top)}, 0);
    while (size_ > 0 && !done()) {
      const GapPair pair = waiting_[size_ - 1];
      if (pair.squared <= squared_limit_) {
        out_.stopped = budget_.grant(1) == 0;
        if (out_.stopped) break;
      }
      --size_;
      if (pair.squared <= squared_limit_) visit(pair);
    }
    measure_added();
  }

  bool done() const {
    const double enough = std::max(0.0, asked_.enough);
    return out_.overlap || out_.stopped || best_.least <= enough * enough;
  }

  void finish() {
    out_.overlap =
        out_.overlap || (best_.least > 0 && !asked_.outside && (holds(false) || holds(true)));
    out_.farther = !out_.overlap && !out_.stopped && best_.least > most_ * most_;
    if (out_.overlap || out_.farther) return;
    out_.a = best_.on_a;
    out_.b = best_.on_a + best_.between;
    out_.distance = best_.least > 0 ? std::sqrt(best_.squared) : 0;
    // Starts from the pair that answers, since which of several equal pairs is the least depends on
    // the search.
    double nearest = std::sqrt(best_.squared) - best_.rounding;
    for (std::uint32_t i = 0; out_.stopped && i < size_; ++i)
      nearest = std::min(nearest, std::sqrt(waiting_[i].squared));
    out_.least = std::max(0.0, (1 - 1e-12) * nearest - slack_);
  }

  /// Drops the last twelve bits: parallel faces are equally near except for rounding. With equal
  /// orders the lowest number comes first, and cannot_answer() prunes the others.
  static float coarse(double x) {
    const auto single = static_cast<float>(std::min(x, 1e37));
    return float_of(bits_of(single) & 0xfffff000u);
  }

  /// Inserts by order from `first` on. The least is on top; among equals the first.
  void push(const GapPair& pair, std::uint32_t first) {
    std::uint32_t place = size_++;
    for (; place > first && waiting_[place - 1].order <= pair.order; --place)
      waiting_[place] = waiting_[place - 1];
    waiting_[place] = pair;
  }

  void visit(const GapPair& pair) {
    if (pair.level_a == 0 && pair.level_b == 0) {
      const double least = measure(pair.a, pair.b, std::sqrt(pair.squared));
      if (keep_ != nullptr && least <= limit_)
        keep(std::uint64_t{pair.a} << 32 | pair.b, kept_least(least));
      // A few pairs stay pending until eight are full.
      if (scratch_.pairs->count > kFew) measure_added();
    } else if (single_) {
      open(pair, single_a_, single_b_);
    } else {
      open(pair, double_a_, double_b_);
    }
  }

  /// True if a solid contains a shell of the other. `b_in_a`: B's in A, else A's in B.
  bool holds(bool b_in_a) const {
    const MeshTree& other = b_in_a ? b_ : a_;
    const MeshOfPair solid =
        b_in_a ? MeshOfPair{a_} : MeshOfPair{b_, &asked_.a_from_b, &asked_.b_from_a};
    for (std::uint32_t s = 0; s < other.header->shell_count; ++s) {
      const exact::Point x = other.vertex(other.blocks[other.shells[s].block].vertex[0]);
      if (is_inside(solid, b_in_a ? map_point(asked_.a_from_b, x) : x)) return true;
    }
    return false;
  }

  /// Opens the larger node: compares its sixteen children with the other's box.
  template <class T>
  void open(const GapPair& pair, const BoxLook<T, double>& at_a, const BoxLook<T, double>& at_b) {
    const bool open_a =
        pair.level_b == 0 || (pair.level_a > 0 && size_of(a_, pair.level_a, pair.a) >=
                                                      scale_ * size_of(b_, pair.level_b, pair.b));
    const MeshTree& mesh = open_a ? a_ : b_;
    const int level = open_a ? pair.level_a : pair.level_b;
    const std::uint32_t number = open_a ? pair.a : pair.b;
    const BoxBlock& boxes = mesh.level[level].boxes[number];
    alignas(64) T squared[kWidth], apart[kWidth];
    const double unit = open_a ? 1 : asked_.a_from_b.scale * asked_.a_from_b.scale;
    const double limit = squared_limit_ / unit;
    std::uint32_t left =
        open_a ? measure_sixteen(at_a, boxes, at_a.see(box_of<double>(b_, pair.level_b, pair.b)),
                                 limit, squared, apart)
               : measure_sixteen(at_b, boxes, at_b.see(box_of<double>(a_, pair.level_a, pair.a)),
                                 limit, squared, apart);
    left &= (1u << std::min(kWidth, mesh.level[level - 1].count - kWidth * number)) - 1;
    const std::uint32_t first = size_;
    const BlockFaces* const beside = left != 0 ? triangles_beside(pair, open_a) : nullptr;
    for (const std::uint32_t l : set_bits(left)) {
      double gap = unit * double{squared[l]};
      if (gap > squared_limit_) continue;
      if (beside != nullptr)
        gap =
            std::max(gap, beside->squared_gap(box(open_a, level - 1, kWidth * number + l), slack_));
      if (gap > squared_limit_) continue;
      GapPair child = pair;
      child.squared = std::max(pair.squared, gap);
      // Distances of solids that are far apart for their size differ in the last digits only.
      child.order = gap <= 0 ? static_cast<float>(apart[l])
                    : single_
                        ? coarse(child.squared)
                        : coarse(std::max(0.0, (1 - kGapsAlike) * child.squared - pair.squared));
      (open_a ? child.a : child.b) = kWidth * number + l;
      --(open_a ? child.level_a : child.level_b);
      push(child, first);
    }
  }

  /// The triangles of the node that stays closed if it is a block and much larger than the other,
  /// else null.
  const BlockFaces* triangles_beside(const GapPair& pair, bool open_a) {
    if ((open_a ? pair.level_b : pair.level_a) != 0) return nullptr;
    const double of_a = size_of(a_, pair.level_a, pair.a),
                 of_b = scale_ * size_of(b_, pair.level_b, pair.b);
    if ((open_a ? of_b : of_a) < kMuchLarger * (open_a ? of_a : of_b)) return nullptr;
    const std::uint32_t number = open_a ? pair.b : pair.a;
    if (!faces_ || faces_of_ != number || faces_of_b_ != open_a) {
      faces_.emplace(vertices(open_a, number), (open_a ? b_ : a_).blocks[number], axes_);
      faces_of_ = number;
      faces_of_b_ = open_a;
    }
    return &*faces_;
  }
  /// The axes along which two blocks' triangles are compared. If one block is much larger, they
  /// follow the direction from its nearest triangle to the other block.
  GapAxes axes_between(std::uint32_t number_a, std::uint32_t number_b) {
    const GapPair blocks{0, 0, number_a, number_b, 0, 0};
    for (const bool of_a : {false, true}) {
      const BlockFaces* const larger = triangles_beside(blocks, of_a);
      if (larger == nullptr) continue;
      const exact::Point between =
          larger->vector_to(box(of_a, 0, of_a ? number_a : number_b).middle);
      if (const double length = std::sqrt(dot(between, between)); length > 0)
        return axes_along((1 / length) * between);
    }
    return axes_;
  }
  PlacedBox box(bool of_a, int level, std::uint32_t number) const {
    return placed_box(of_a ? a_ : b_, level, number, of_a ? nullptr : &asked_.a_from_b, axes_);
  }

  const PlacedVertices& vertices(bool of_b, std::uint32_t number) {
    return of_b ? placed_vertices(b_, number, &asked_.a_from_b, *scratch_.placed_b)
                : placed_vertices(a_, number, nullptr, *scratch_.placed_a);
  }

  /// Queues the triangles of two blocks, which are no nearer than `known`, that may be near enough.
  /// Returns a lower bound of the distance of those that are within `limit_`.
  double measure(std::uint32_t number_a, std::uint32_t number_b, double known) {
    const PlacedVertices &of_a = vertices(false, number_a), &of_b = vertices(true, number_b);
    const double ahead = gap_along(level_, of_a, of_b);
    const std::uint64_t first = std::uint64_t{kWidth * number_a} << 32 | kWidth * number_b;
    if (cannot_answer(ahead, first)) return known;
    if (single_ && ahead - slack_ > limit_) return ahead - slack_;
    const std::uint32_t all_a = (1u << a_.blocks[number_a].triangles) - 1,
                        all_b = (1u << b_.blocks[number_b].triangles) - 1;
    const auto take = [&](std::uint32_t i, std::uint32_t lanes) {
      for (const std::uint32_t k : set_bits(lanes))
        add(kWidth * number_a + i, of_a, kWidth * number_b + k, of_b);
    };
    const GapAxes axes = axes_between(number_a, number_b);
    if (!single_) {
      const BlockExtents a(of_a, a_.blocks[number_a], axes), b(of_b, b_.blocks[number_b], axes);
      for (const std::uint32_t i : set_bits(a.near(b, squared_limit_) & all_a))
        take(i, b.near(a, i, squared_limit_) & all_b);
      return known;
    }
    const PlacedTriangles& a = placed_triangles(a_, number_a, nullptr, *scratch_.placed_a);
    const PlacedTriangles& b = placed_triangles(b_, number_b, &asked_.a_from_b, *scratch_.placed_b);
    TriangleCulls culls(a, b, axes, static_cast<float>(blur_));
    float least = HUGE_VALF;
    std::optional<Meeting> meeting;
    for (const std::uint32_t i : set_bits(culls.rows(limit_) & all_a)) {
      const std::uint32_t near = culls.lanes(i, nearest_limit_, limit_, least) & all_b;
      if (near == 0) continue;
      take(i, planes_pay() ? within_planes(first, i, near, meeting) : near);
      if (done()) break;
    }
    return std::max(known, std::sqrt(double{least}));
  }

  /// True if no triangles of two blocks are nearer than the best pair, up to rounding, and they
  /// come after it. This excludes most pairs of parallel faces, which floats cannot distinguish
  /// from nearer ones. `first`: the first of their pairs.
  bool cannot_answer(double ahead, std::uint64_t first) const {
    const double distance = std::sqrt(best_.least);
    return best_.pair < first && distance >= 4 * best_.rounding &&
           ahead >= distance - 0.5 * best_.rounding;
  }

  /// True if many pairs were measured in vain, and planes, if tried, have excluded some.
  bool planes_pay() const {
    const std::uint32_t vain = out_.tests - better_at_;
    return vain > kVain && vain < 2 * kVain + 4 * excluded_;
  }
  /// The triangles of B among `lanes` that planes do not prove to be as far from A's triangle i as
  /// the best pair, up to rounding; all of them if they come before that pair. Parts that fit have
  /// many that are as near, which floats cannot distinguish from nearer ones.
  HWY_NOINLINE std::uint32_t within_planes(std::uint64_t first, std::uint32_t i,
                                           std::uint32_t lanes, std::optional<Meeting>& meeting) {
    best_planes_.touch = std::sqrt(best_.least) - 0.5 * best_.rounding;
    if (best_.pair > first || best_planes_.touch < 3.5 * best_.rounding) return lanes;
    if (!meeting)
      meeting.emplace(best_planes_, scratch_, static_cast<std::uint32_t>(first >> 32) / kWidth,
                      static_cast<std::uint32_t>(first) / kWidth, Margin::rounding, 0.0f);
    const std::uint32_t left = meeting->within_touch(i, lanes);
    excluded_ += static_cast<std::uint32_t>(std::popcount(lanes & ~left));
    return left;
  }

  void add(std::uint64_t pair) {
    const auto a = static_cast<std::uint32_t>(pair >> 32), b = static_cast<std::uint32_t>(pair);
    add(a, vertices(false, a / kWidth), b, vertices(true, b / kWidth));
  }

  void add(std::uint32_t triangle_a, const PlacedVertices& vertices_a, std::uint32_t triangle_b,
           const PlacedVertices& vertices_b) {
    TrianglePairs& pairs = *scratch_.pairs;
    const std::uint32_t n = pairs.count;
    const auto take = [&](int side, const MeshTree& mesh, std::uint32_t triangle,
                          const PlacedVertices& from) {
      const MeshBlock& block = mesh.blocks[triangle / kWidth];
      for (int c = 0; c < 3; ++c) {
        const std::uint32_t v = block.corner[c][triangle % kWidth];
        for (int k = 0; k < 3; ++k) pairs.corner[side][c][k][n] = from.at[k][v];
      }
      pairs.triangle[side][n] = triangle;
    };
    take(0, a_, triangle_a, vertices_a);
    take(1, b_, triangle_b, vertices_b);
    if (++pairs.count == 8) measure_added();
  }

  void measure_added() {
    TrianglePairs& pairs = *scratch_.pairs;
    const std::uint32_t count = pairs.count;
    pairs.count = 0;
    if (count == 0 || out_.overlap) return;
    out_.tests += count;
    PairGaps gaps;
    std::uint32_t unclear = measure_pairs(pairs, count, slack_, gaps);
    // If two share a point, the answer is 0, whether triangles cross or not.
    if (*std::min_element(gaps.squared, gaps.squared + count) <= 0) unclear = 0;
    for (; unclear != 0 && !out_.overlap; unclear &= unclear - 1) {
      const auto n = static_cast<std::uint32_t>(std::countr_zero(unclear));
      out_.overlap = crosses(pairs, gaps, n, slack_);
    }
    if (out_.overlap) return;
    const double before = best_.least;
    for (std::uint32_t n = 0; n < count; ++n) {
      const std::uint64_t name = std::uint64_t{pairs.triangle[0][n]} << 32 | pairs.triangle[1][n];
      const double found = gaps.squared[n];
      best_.meet(found);
      if (best_.wants(found, name))
        best_.set(found, name, {gaps.on_a[0][n], gaps.on_a[1][n], gaps.on_a[2][n]},
                  {gaps.between[0][n], gaps.between[1][n], gaps.between[2][n]});
    }
    if (!(best_.least < before)) return;
    better_at_ = out_.tests;
    const double distance = std::sqrt(best_.least);
    limit_to(std::min(nearest_limit_, single_ ? distance + slack_ : (1 - kGapsAlike) * distance));
    if (distance > 0) {
      look_along((1 / distance) * best_.between);
      for (std::uint32_t n = 0; n < count; ++n)
        if (best_.pair == (std::uint64_t{pairs.triangle[0][n]} << 32 | pairs.triangle[1][n]))
          for (int side = 0; side < 2; ++side)
            level_with(corners(pairs, side, n).at, toward_, level_);
    }
  }

  static std::uint64_t kept_least(double least) {
    return bits_of(static_cast<float>((1 - 1e-6) * std::min(least, 1e30)));
  }
  /// Keeps two blocks for the next steps.
  void keep(std::uint64_t blocks, std::uint64_t bound) {
    KeptRing& ring = scratch_.near;
    if (keep_->count + 2 > ring.most()) {
      KeptRing::give_up(*keep_);
      keep_ = nullptr;
      look_ahead(0);
      return;
    }
    ring.add(*keep_, blocks);
    ring.add(*keep_, bound);
  }

  const GapQuestion& asked_;
  const MeshTree &a_, &b_;
  Budget& budget_;
  ExactScratch& scratch_;
  GapPair* const waiting_;  ///< a stack
  std::uint32_t size_ = 0;
  const double scale_, reach_;
  const bool single_;                           ///< boxes are measured in floats
  const double slack_;                          ///< the rounding of triangles' distances
  const double blur_;                           ///< likewise of boxes
  BoxLook<float, double> single_a_, single_b_;  ///< A's boxes seen from B, and B's from A
  BoxLook<double, double> double_a_, double_b_;
  double most_, nearest_limit_ = 0, ahead_ = 0, limit_ = 0;
  double squared_limit_ = 0;
  NearestTriangles best_;
  /// The last direction of the best pair, and its normal if the faces are parallel.
  exact::Point toward_, level_ = {0, 0, 0};
  GapAxes axes_;
  std::optional<BlockFaces> faces_;  ///< of a block, along the axes
  std::uint32_t faces_of_ = 0;
  bool faces_of_b_ = false;
  CrossingSearch best_planes_;  ///< planes keep triangles as far as `touch`
  std::uint32_t better_at_ = 0,
                excluded_ = 0;  ///< pairs measured until the best; left out by planes
  KeptPairs* keep_ = nullptr;
  MeshGap out_;
};

MeshGap search_gap(const GapQuestion& question, Budget& budget, ExactScratch& scratch) {
  return MeshGapSearch(question, budget, scratch).run();
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(search_gap);

MeshGap mesh_gap(const GapQuestion& question, Budget& budget, ExactScratch& scratch) noexcept {
  return HWY_DYNAMIC_DISPATCH(search_gap)(question, budget, scratch);
}

}  // namespace ist
#endif
