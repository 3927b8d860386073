#pragma once

#include <cstdint>

#include "base/bits.h"
#include "base/host_device.h"
#include "cuda/query/ball_tests.h"

// Boxes and terrains: fields whose triangles are generated on demand (query/shape/patch_shapes.h).

namespace ist::gpu {

/// A face of a box or of a cell of a terrain.
struct FacetId {
  std::uint32_t a, b;
};

struct FacetWalkMemory : WalkMemory {
  TestMemory<FacetId> tests;
};

/// The triangles of a box or a terrain, as a Source of BallTests.
class FacetSource {
 public:
  using Id = FacetId;

  /// `whole`: a ball around all that is queried.
  IST_HD FacetSource(const FieldRef& field, const double (&whole)[4])
      : field_(field), whole_(whole) {}

  IST_HD void corners(const FacetId& id, double (&c)[3][3]) const {
    if (field_.kind == FieldKind::box) {
      field_.box.corners(id.a, c);
      return;
    }
    const std::int64_t i = std::int64_t{id.a} - 1, j = std::int64_t{id.b / 2} - 1;
    const bool second = id.b % 2 != 0;
    grid_point(i, j, c[0]);
    grid_point(i + 1, second ? j + 1 : j, c[1]);
    grid_point(second ? i : i + 1, j + 1, c[2]);
  }

  /// The triangles that may be near a ball, by number.
  class Near {
   public:
    Near() = default;
    IST_HD Near(const FieldRef& field, const double (&x)[3], double reach) {
      if (field.kind == FieldKind::box) return;
      for (int k = 0; k < 2; ++k) {
        std::int64_t to;
        field.height.cells_near(k, x[k], reach, from_[k], to);
        count_[k] = to - from_[k] + 1;
      }
    }

    IST_HD std::uint64_t size() const {
      return from_[0] == kBox ? 12 : 2 * static_cast<std::uint64_t>(count_[0] * count_[1]);
    }
    IST_HD FacetId operator[](std::uint64_t i) const {
      if (from_[0] == kBox) return {static_cast<std::uint32_t>(i), 0};
      const auto cell = static_cast<std::int64_t>(i / 2);
      const std::int64_t row = cell / count_[0];
      return {
          static_cast<std::uint32_t>(from_[0] + (cell - row * count_[0]) + 1),
          static_cast<std::uint32_t>(2 * (from_[1] + row + 1)) + static_cast<std::uint32_t>(i % 2)};
    }

   private:
    static constexpr std::int64_t kBox = -2;
    std::int64_t from_[2] = {kBox, 0}, count_[2] = {0, 0};
  };

  template <class Team, class Visit>
  IST_HD void each_near(const Team& team, const double (&x)[3], double reach,
                        const Visit& visit) const {
    const Near near(field_, x, reach);
    const std::uint64_t size = near.size();
    for (std::uint64_t base = 0; base < size; base += Team::kWidth) {
      const std::uint64_t i = base + static_cast<std::uint64_t>(team.lane());
      visit(i < size, i < size ? near[i] : FacetId{});
    }
  }

  template <class Team>
  IST_HD bool inside(const Team&, bool wanted, const double (&x)[3]) const {
    if (!wanted) return false;
    if (field_.kind == FieldKind::box) return field_.box.holds(x);
    const PlainTerrain& f = field_.height;
    return x[2] < f.surface(
                      x[0], x[1], [&](std::int64_t i, std::int64_t j) { return f.height(i, j); });
  }

  /// A ball near at most one face of a box needs no triangles.
  IST_HD bool settles(const double (&x)[3], double r, BallPart& part) const {
    if (field_.kind != FieldKind::box) return false;
    int axis;
    double side;
    if (field_.box.faces_near(x, r, axis, side) > 1) return false;
    PlainSample at = {-r, {}};
    for (int k = 0; k < 3; ++k) {
      at.distance = k == axis ? -field_.box.below_face(k, side, x[k]) : at.distance;
      at.gradient[k] = k == axis ? side : 0;
    }
    part = flat_part(at, r);
    return true;
  }

 private:
  IST_HD void grid_point(std::int64_t i, std::int64_t j, double (&p)[3]) const {
    p[0] = field_.height.point(0, i, whole_[0], whole_[3]);
    p[1] = field_.height.point(1, j, whole_[1], whole_[3]);
    p[2] = field_.height.height(i, j);
  }

  const FieldRef& field_;
  const double (&whole_)[4];
};

/// Finds the balls that the triangles of a box or a terrain intersect, part by part. Sums balls
/// that are inside as a whole or near a single face.
template <class Team>
class FacetWalk {
 public:
  /// `memory` contains the tree and its place.
  IST_HD FacetWalk(const Team& team, FacetWalkMemory& memory, PartSums& sums)
      : team_(team),
        m_(memory),
        sums_(sums),
        source_(memory.field, memory.whole),
        tests_(team, memory, memory.tests, source_, sums) {}

  IST_HD void start() {
    if (team_.lane() == 0) {
      const double centre[3] = {m_.whole[0], m_.whole[1], m_.whole[2]};
      m_.tests.seen.look_from(centre, m_.whole[3]);
    }
    team_.sync();
  }

  /// Calls take(met, end) with the results. `end`: the part is complete, else more of the same
  /// balls follow. Once take() returns false, the rest is traversed without tests.
  template <class Take>
  IST_HD void run(const Take& take) {
    FieldWalk<Team> walk(team_, m_, sums_);
    walk.run([&](const std::uint32_t* blocks, int have) { add(blocks, have, take); });
  }

 private:
  /// Tests leaf blocks, or without any hands over the rest.
  template <class Take>
  IST_HD void add(const std::uint32_t* blocks, int have, const Take& take) {
    for (int next = 0; goes_on_;) {
      if (tests_.step()) continue;
      const bool ends = !tests_.full();
      if (ends && staged_ < near_size_) {
        stage_more();
      } else if (ends && have > 0 && next == have) {
        return;
      } else if (ends && have > 0 && tests_.has_space()) {
        begin(blocks[next++]);
      } else {
        goes_on_ = take(tests_.met(), ends);
        tests_.forget(ends);
        if (have == 0) return;
      }
    }
  }

  IST_HD void begin(std::uint32_t block) {
    block_ = block;
    first_ = true;
    staged_ = 0;
    const NodeBall ball = m_.tree.ball(0, block);
    double centre[3];
    m_.place.a_from_b.apply_fused(ball.centre, centre);
    const double reach = ball.r * m_.place.a_from_b.scale * (1 + 1e-12);
    near_ = FacetSource::Near(m_.field, centre, reach);
    near_size_ = near_.size();
    if (m_.field.kind == FieldKind::box) return;
    if (team_.lane() == 0) m_.tests.seen.look_from(centre, reach);
    team_.sync();
  }

  /// Stages the block's test against the next triangles that may be near it.
  IST_HD void stage_more() {
    std::uint32_t near = 0;
    for (int i = 0; i < kItemsALane; ++i) {
      const int place = i * Team::kWidth + team_.lane();
      const std::uint64_t k = staged_ + static_cast<std::uint64_t>(place);
      bool comes = k < near_size_;
      if (comes && !seen_) {
        const FacetId id = near_[k];
        double c[3][3];
        source_.corners(id, c);
        m_.tests.id[place] = id;
        m_.tests.seen.see(place, c);
        comes = m_.field.kind == FieldKind::box ||
                SeenTriangles::meets(m_.tests.seen.from_centre(place), 1 + kSeenTolerance);
      }
      near |= team_.ballot(comes) << (i * Team::kWidth);
    }
    seen_ = m_.field.kind == FieldKind::box;
    staged_ += kSeen;
    for (int half = team_.lane(); half < 2; half += Team::kWidth) {
      m_.tests.tested[half].block = block_;
      m_.tests.tested[half].triangles = near;
    }
    team_.sync();
    tests_.stage(false, first_, staged_ >= near_size_);
    first_ = false;
  }

  static constexpr int kItemsALane = kItems / Team::kWidth;

  const Team& team_;
  FacetWalkMemory& m_;
  PartSums& sums_;
  const FacetSource source_;
  BallTests<Team, FacetSource> tests_;
  bool goes_on_ = true;
  std::uint32_t block_ = 0;                   ///< the current block
  bool first_ = false;                        ///< it has not been tested
  bool seen_ = false;                         ///< the triangles of a box are staged, for all blocks
  FacetSource::Near near_;                    ///< triangles that may come near the block
  std::uint64_t near_size_ = 0, staged_ = 0;  ///< the number of near triangles, and of those staged
};

}  // namespace ist::gpu
