#pragma once

#include <cmath>
#include <cstdint>

#include "cuda/query/ball_tests.h"
#include "cuda/query/field_walk.h"
#include "numerics/host_device.h"

// Boxes and terrains: fields whose triangles are made on the spot (query/field/patch_shapes.h).

namespace ist::gpu {

/// A face of a box or of a cell of a terrain.
struct FacetId {
  std::uint32_t a, b;
};

struct FacetWalkMemory : WalkMemory {
  TestMemory<FacetId> tests;
};

/// The triangles of a box or a terrain (BallTests).
class FacetSource {
 public:
  using Id = FacetId;
  static constexpr bool kCrossings = false;

  /// `whole`: a ball around all that is asked for.
  IST_HD FacetSource(const FieldRef& field, const double (&whole)[4])
      : field_(field), whole_(whole) {}

  IST_HD void corners(const FacetId& id, double (&c)[3][3]) const {
    if (field_.kind == FieldKind::box) {
      // Corners of the faces, counter-clockwise from outside, four bits each.
      constexpr std::uint32_t kFaces[6] = {0x2640, 0x5731, 0x4510, 0x3762, 0x1320, 0x6754};
      const std::uint32_t face = kFaces[id.a / 2], first = 1 + id.a % 2;
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t corner = face >> 4 * (k == 0 ? 0 : first + k - 1);
        for (int axis = 0; axis < 3; ++axis)
          c[k][axis] = (corner >> axis & 1) != 0 ? field_.box.half[axis] : -field_.box.half[axis];
      }
      return;
    }
    const std::int64_t i = std::int64_t{id.a} - 1, j = std::int64_t{id.b / 2} - 1;
    const bool second = id.b % 2 != 0;
    grid_point(i, j, c[0]);
    grid_point(i + 1, second ? j + 1 : j, c[1]);
    grid_point(second ? i : i + 1, j + 1, c[2]);
  }

  /// The triangles that may come near a ball, by number.
  class Near {
   public:
    Near() = default;
    IST_HD Near(const FieldRef& field, const double (&x)[3], double reach) {
      if (field.kind == FieldKind::box) return;
      for (int k = 0; k < 2; ++k) {
        const double low = (x[k] - reach) / field.height.spacing[k];
        const double high = (x[k] + reach) / field.height.spacing[k];
        const double last = (k == 0 ? field.height.columns : field.height.rows) - 1.0;
        // Beyond the border one cell is as good as any number: it is level across it.
        from_[k] = static_cast<std::int64_t>(floor(clamped(low, -1, last)));
        count_[k] = static_cast<std::int64_t>(floor(clamped(high, -1, last))) - from_[k] + 1;
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
    if (field_.kind == FieldKind::height) return x[2] < surface(x[0], x[1]);
    return size_of(x[0]) < field_.box.half[0] && size_of(x[1]) < field_.box.half[1] &&
           size_of(x[2]) < field_.box.half[2];
  }

  /// A ball that comes near one face of a box, or none, needs no triangles.
  IST_HD bool settles(const double (&x)[3], double r, PartInside& part) const {
    if (field_.kind != FieldKind::box) return false;
    const double(&half)[3] = field_.box.half;
    int faces = 0, axis = 0;
    double side = 1;
    for (int k = 0; k < 3; ++k) {
      for (int s = 1; s >= -1; s -= 2) {
        if (half[k] - s * x[k] >= r) continue;
        ++faces;
        axis = k;
        side = s;
      }
    }
    if (faces > 1) return false;
    DistanceLook at = {r, {0, 0, 0}};
    for (int k = 0; k < 3; ++k) {
      if (faces == 0 || k != axis) continue;
      at.distance = half[k] - side * x[k];
      at.gradient[k] = -side;
    }
    part = flat_part(at, r);
    return true;
  }

 private:
  IST_HD double height(std::int64_t i, std::int64_t j) const {
    const HeightRef& f = field_.height;
    const std::int64_t last[2] = {std::int64_t{f.columns} - 1, std::int64_t{f.rows} - 1};
    i = i < 0 ? 0 : i > last[0] ? last[0] : i;
    j = j < 0 ? 0 : j > last[1] ? last[1] : j;
    return static_cast<double>(
        f.heights[static_cast<std::uint64_t>(j) * f.columns + static_cast<std::uint64_t>(i)]);
  }

  /// The cells at the border reach as far as the balls do.
  IST_HD void grid_point(std::int64_t i, std::int64_t j, double (&p)[3]) const {
    const HeightRef& f = field_.height;
    const std::int64_t n[2] = {i, j};
    const double reach = 2 * whole_[3];
    for (int k = 0; k < 2; ++k) {
      const std::int64_t last = std::int64_t{k == 0 ? f.columns : f.rows} - 1;
      const double at = static_cast<double>(n[k]) * f.spacing[k];
      p[k] = n[k] < 0      ? least(at, whole_[k] - reach)
             : n[k] > last ? most(at, whole_[k] + reach)
                           : at;
    }
    p[2] = height(i, j);
  }

  /// Height of the terrain over a point.
  IST_HD double surface(double x, double y) const {
    const HeightRef& f = field_.height;
    const double u = clamped(x / f.spacing[0], -1, f.columns);
    const double v = clamped(y / f.spacing[1], -1, f.rows);
    const double i = floor(u), j = floor(v), s = u - i, t = v - j;
    const auto a = static_cast<std::int64_t>(i), b = static_cast<std::int64_t>(j);
    const double low = height(a, b), high = height(a + 1, b + 1);
    const double side = s >= t ? height(a + 1, b) : height(a, b + 1);
    return s >= t ? low + s * (side - low) + t * (high - side)
                  : low + t * (side - low) + s * (high - side);
  }

  const FieldRef& field_;
  const double (&whole_)[4];
};

/// Finds the balls that the triangles of a box or a terrain meet, part by part; sums those that
/// lie inside as a whole or come near one face alone.
template <class Team>
class FacetWalk {
 public:
  /// `memory` holds the tree and its place.
  IST_HD FacetWalk(const Team& team, FacetWalkMemory& memory, PartSums& sums)
      : team_(team),
        m_(memory),
        sums_(sums),
        source_(memory.field, memory.whole),
        tests_(team, memory, memory.tests, source_, sums) {}

  /// As SurfaceWalk, which alone needs a side to begin with.
  IST_HD void start(bool) {
    if (team_.lane() == 0) {
      const double centre[3] = {m_.whole[0], m_.whole[1], m_.whole[2]};
      m_.tests.seen.look_from(centre, m_.whole[3]);
    }
    team_.sync();
  }

  /// As SurfaceWalk, but that it goes on to the end, without tests, where take() is false.
  template <class Take>
  IST_HD void run(const Take& take) {
    FieldWalk<Team> walk(team_, m_, sums_);
    walk.run([&](const std::uint32_t* blocks, int have) { add(blocks, have, take); });
  }

 private:
  /// Tests leaf blocks; none: hands over what is left.
  template <class Take>
  IST_HD void add(const std::uint32_t* blocks, int have, const Take& take) {
    for (int next = 0; goes_on_;) {
      if (tests_.step()) continue;
      const bool ends = !tests_.full();
      if (ends && staged_ < near_size_) {
        stage_more();
      } else if (ends && have > 0 && next == have) {
        return;
      } else if (ends && have > 0 && tests_.room()) {
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
    m_.place.a_from_b.apply(ball.centre, centre);
    const double reach = ball.r * m_.place.a_from_b.scale * (1 + 1e-12);
    near_ = FacetSource::Near(m_.field, centre, reach);
    near_size_ = near_.size();
    if (m_.field.kind == FieldKind::box) return;
    if (team_.lane() == 0) m_.tests.seen.look_from(centre, reach);
    team_.sync();
  }

  /// Readies the block's test against the next of the triangles that may come near it.
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
                SeenTriangles::meets(m_.tests.seen.from_centre(place), 1 + kSeenRoom);
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
  std::uint32_t block_ = 0;                   ///< in work
  bool first_ = false;                        ///< it has not been tested
  bool seen_ = false;                         ///< the triangles of a box are, for all blocks
  FacetSource::Near near_;                    ///< triangles that may come near it
  std::uint64_t near_size_ = 0, staged_ = 0;  ///< how many, and how many were tested
};

}  // namespace ist::gpu
