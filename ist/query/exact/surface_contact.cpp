#include "base/bits.h"
#include "query/exact/crossing_search.h"

#include <bit>
#include <optional>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/exact/surface_contact.cpp"
#include <hwy/foreach_target.h>

#include "query/exact/block_meeting-inl.h"
#include "query/exact/nearest_points.h"
#include "query/exact/pair_signs-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

class ContactSearch : PairSigns {
 public:
  ContactSearch(const CrossingSearch& search, ExactScratch& scratch)
      : PairSigns(search), scratch_(scratch), placed_(search, scratch) {
    scratch_.pairs->count = 0;
  }

  SurfaceContact contact(std::uint32_t count, const KeptPairs* kept) {
    SurfaceContact out;
    TrianglePairs& pairs = *scratch_.pairs;
    const auto look = [&](std::uint32_t which) {
      for (; which != 0 && !out.touching; which &= which - 1) {
        const ExactCorners corners(pairs, static_cast<std::uint32_t>(std::countr_zero(which)));
        out.touching = exact::come_within(search_.touch, corners.of[0], corners.of[1]);
      }
    };
    const auto add_areas = [&] {
      look((1u << pairs.count) - 1);
      alignas(64) double area[8], along[3][8], moment[3][8];
      find_areas(pairs, area, along, moment);
      for (std::uint32_t n = 0; n < pairs.count; ++n) {
        out.area += area[n];
        out.normal = out.normal + exact::Point{along[0][n], along[1][n], along[2][n]};
        out.moment = out.moment + exact::Point{moment[0][n], moment[1][n], moment[2][n]};
      }
      pairs.count = 0;
    };
    std::optional<Meeting> now;
    std::uint64_t blocks = ~std::uint64_t{0};
    const auto meet = [&](std::uint32_t number_a, std::uint32_t number_b) -> Meeting& {
      const std::uint64_t met = std::uint64_t{number_a} << 32 | number_b;
      if (std::exchange(blocks, met) != met)
        now.emplace(search_, scratch_, number_a, number_b, Margin::reach, search_.near);
      return *now;
    };
    visit_near(
        count, kept,
        [&](std::uint32_t number_a, std::uint32_t i, std::uint32_t number_b, std::uint32_t lanes) {
          lanes &= facing(placed_.triangles(false, number_a), i, placed_.triangles(true, number_b));
          if (lanes == 0) return false;
          Meeting& both = meet(number_a, number_b);
          lanes = both.flush(i, lanes);
          if (lanes != 0) lanes = both.within_edges(i, lanes, edges_);
          for (const std::uint32_t j : set_bits(lanes)) {
            gather(kWidth * number_a + i, both.vertices(0), kWidth * number_b + j,
                   both.vertices(1));
            if (pairs.count == 8) add_areas();
          }
          return false;
        });
    add_areas();
    if (out.touching) return out;
    // If no faces touch, a point or an edge may.
    const auto look_at_near = [&] {
      if (pairs.count != 0)
        look(((1u << pairs.count) - 1) & ~far_by_planes(pairs, pairs.count, search_.touch));
      pairs.count = 0;
    };
    visit_near(
        count, kept,
        [&](std::uint32_t number_a, std::uint32_t i, std::uint32_t number_b, std::uint32_t lanes) {
          Meeting& both = meet(number_a, number_b);
          for (lanes = both.within_touch(i, lanes); lanes != 0; lanes &= lanes - 1) {
            const auto j = static_cast<std::uint32_t>(std::countr_zero(lanes));
            gather(kWidth * number_a + i, both.vertices(0), kWidth * number_b + j,
                   both.vertices(1));
            if (pairs.count == 8) look_at_near();
          }
          return out.touching;
        });
    look_at_near();
    return out;
  }

 private:
  /// Calls visit(A's block, its triangle, B's block, some of its triangles) until it returns true,
  /// for triangles whose boxes intersect in blocks that are marked as near, or in kept pairs.
  template <class Visit>
  void visit_near(std::uint32_t count, const KeptPairs* kept, const Visit& visit) {
    for (std::uint32_t n = 0; n < (kept != nullptr ? kept->count : count); ++n) {
      const std::uint64_t pair = kept != nullptr ? scratch_.kept.pair(*kept, n) : scratch_.keys[n];
      const auto a = static_cast<std::uint32_t>(pair >> 32), b = static_cast<std::uint32_t>(pair);
      if (kept != nullptr) {
        if (is_near(a / kWidth, b / kWidth) &&
            visit(a / kWidth, a % kWidth, b / kWidth, 1u << b % kWidth))
          return;
        continue;
      }
      if (!is_near(a, b)) continue;
      const PlacedTriangles &of_a = placed_.triangles(false, a), &of_b = placed_.triangles(true, b);
      const OneBox all(of_b.all_low, of_b.all_high, search_.near);
      for (const std::uint32_t i : set_bits(meeting(of_a.low, of_a.high, all.low, all.high))) {
        const OneBox box(of_a.low, of_a.high, i, search_.near);
        const std::uint32_t lanes = meeting(of_b.low, of_b.high, box.low, box.high);
        if (lanes != 0 && visit(a, i, b, lanes)) return;
      }
    }
  }

  /// The triangles of B that may face A's triangle i. In float: the sum of a normal's coordinates
  /// is at most 1.8 times its length.
  static std::uint32_t facing(const PlacedTriangles& a, std::uint32_t i, const PlacedTriangles& b) {
    const F d;
    const auto length_a = hn::Set(d, a.length[i]), slack_a = hn::Set(d, a.slack[i]);
    std::uint32_t bits = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      const auto length_b = hn::Load(d, b.length + l), slack_b = hn::Load(d, b.slack + l);
      const auto along = (hn::Set(d, a.normal[0][i]) * hn::Load(d, b.normal[0] + l) +
                          hn::Set(d, a.normal[1][i]) * hn::Load(d, b.normal[1] + l)) +
                         hn::Set(d, a.normal[2][i]) * hn::Load(d, b.normal[2] + l);
      const auto off = hn::Set(d, 2.0f) * (slack_a * length_b + slack_b * length_a) +
                       hn::Set(d, 3.0f) * slack_a * slack_b;
      bits |= mask_bits(d, along <= off - hn::Set(d, 0.3f) * length_a * length_b) << l;
    }
    return bits;
  }

  /// The common areas of pairs in one plane, and the same along A's normal; 0 for pairs that face
  /// the same direction.
  static HWY_NOINLINE void find_areas(const TrianglePairs& pairs, double (&area)[8],
                                      double (&along)[3][8], double (&moment)[3][8]) {
    const D d;
    for (std::size_t l = 0; l < pairs.count; l += hn::Lanes(d)) {
      Vec3 corner[2][3];
      for (int s = 0; s < 2; ++s)
        for (int c = 0; c < 3; ++c) corner[s][c] = corner_of(pairs, s, c, l);
      const auto normal_of = [](const Vec3(&t)[3]) { return cross(t[1] - t[0], t[2] - t[0]); };
      const Vec3 normal = normal_of(corner[0]);
      const V length = hn::Sqrt(dot(normal, normal));
      const CommonArea common = common_area(corner[0], corner[1], normal);
      const V factor =
          hn::IfThenElseZero(dot(normal, normal_of(corner[1])) < hn::Zero(d), common.over_normal);
      const V whole = factor * length;
      const Vec3 centre = corner[0][0] + common.centre;
      hn::Store(whole * centre.x, d, moment[0] + l);
      hn::Store(whole * centre.y, d, moment[1] + l);
      hn::Store(whole * centre.z, d, moment[2] + l);
      hn::Store(whole, d, area + l);
      hn::Store(factor * normal.x, d, along[0] + l);
      hn::Store(factor * normal.y, d, along[1] + l);
      hn::Store(factor * normal.z, d, along[2] + l);
    }
  }

  void gather(std::uint32_t triangle_a, const PlacedVertices& vertices_a, std::uint32_t triangle_b,
              const PlacedVertices& vertices_b) {
    TrianglePairs& pairs = *scratch_.pairs;
    put_triangle(*search_.a, triangle_a, vertices_a, 0, pairs);
    put_triangle(*search_.b, triangle_b, vertices_b, 1, pairs);
    ++pairs.count;
  }
  bool is_near(std::uint32_t block_a, std::uint32_t block_b) const {
    return has(scratch_.a.near, block_a) && has(scratch_.b.near, block_b);
  }

  ExactScratch& scratch_;
  PlacedMeshes placed_;
  EdgeTally edges_;
};

SurfaceContact search_contact(const CrossingSearch& search, std::uint32_t count,
                              const KeptPairs* kept, ExactScratch& scratch) {
  return ContactSearch(search, scratch).contact(count, kept);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(search_contact);

SurfaceContact find_contact(const CrossingSearch& search, std::uint32_t count,
                            const KeptPairs* kept, ExactScratch& scratch) noexcept {
  return HWY_DYNAMIC_DISPATCH(search_contact)(search, count, kept, scratch);
}

}  // namespace ist
#endif
