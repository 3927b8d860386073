#include "query/shape/patch_shapes.h"

#include <algorithm>
#include <cmath>

#include "query/base/relative_pose.h"
#include "query/exact/nearest_points.h"

namespace ist {
namespace {

/// Passes triangles to add_patch(), sixteen at a time.
class PatchFiller {
 public:
  PatchFiller(const ProbeBalls& balls, std::uint32_t used, ProbeSums& sums) noexcept
      : balls_(balls), used_(used), sums_(sums) {}

  void add(const double (&a)[3], const double (&b)[3], const double (&c)[3]) noexcept {
    const double* const corners[3] = {a, b, c};
    for (std::size_t k = 0; k < 3; ++k) {
      corners_.x[k][size_] = corners[k][0];
      corners_.y[k][size_] = corners[k][1];
      corners_.z[k][size_] = corners[k][2];
    }
    if (++size_ == kWidth) flush();
  }

  void flush() noexcept {
    if (size_ == 0) return;
    for (std::size_t i = size_; i < kWidth; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        corners_.x[k][i] = corners_.y[k][i] = corners_.z[k][i] = 0;
    SurfacePatch patch;
    make_patch(corners_, patch);
    const std::uint32_t near = triangles_near(patch, balls_.origin, balls_.reach);
    if (near != 0) add_patch(patch, near, balls_, used_, sums_);
    size_ = 0;
  }

 private:
  const ProbeBalls& balls_;
  const std::uint32_t used_;
  ProbeSums& sums_;
  TriangleCorners corners_;
  std::size_t size_ = 0;
};

}  // namespace

ProbeTotal BoxSampler::block(const ProbeBalls& balls, std::uint32_t used, const double (&origin)[3],
                             std::uint32_t& pairs) noexcept {
  int axis;
  double side;
  const int faces = faces_near(balls.origin, balls.reach, axis, side);
  if (faces == 1) {
    ProbeTotal total;
    Eigen::Vector3d inward = Eigen::Vector3d::Zero();
    inward[axis] = -side;
    const double* const at[3] = {balls.x, balls.y, balls.z};
    for (std::size_t i = 0; i < kWidth; ++i) {
      if ((used >> i & 1) == 0) continue;
      const double r = balls.r[i];
      const double distance = below_face(axis, side, balls.origin[axis] + at[axis][i]);
      if (!(distance > -r)) continue;
      const Cap part = cap(r, distance);
      const Eigen::Vector3d x = balls.centre(i) - vector(origin);
      ++pairs;
      add_part(x, part.volume, part.derivative * inward, part.moment * inward, total.overlap);
      total.area += part.derivative;
      total.crossed += part.derivative > 0 ? ball_volume(r) : 0;
    }
    return total;
  }
  if (!has_patch_) {
    TriangleCorners corners{};
    for (std::uint32_t n = 0; n < 12; ++n) {
      double c[3][3];
      PlainBox::corners(n, c);
      for (std::size_t k = 0; k < 3; ++k) {
        corners.x[k][n] = c[k][0];
        corners.y[k][n] = c[k][1];
        corners.z[k][n] = c[k][2];
      }
    }
    make_patch(corners, patch_);
    has_patch_ = true;
  }
  ProbeSums sums;
  const std::uint32_t near = triangles_near(patch_, balls.origin, balls.reach);
  if (near != 0) add_patch(patch_, near, balls, used, sums);
  pairs += sums.pairs;
  const ProbeBalls seen = off_edges(balls, sums, [&](const ProbeBalls& moved, ProbeSums& there) {
    add_patch(patch_, (1u << 12) - 1, moved, sums.on_edge, there);
  });
  std::uint32_t inside = 0;
  for (std::uint32_t i = 0; i < kWidth; ++i) {
    const Eigen::Vector3d x = seen.centre(i);
    inside |= holds({x.x(), x.y(), x.z()}) ? 1u << i : 0u;
  }
  return total_of(balls, sums, sides_by_angles(sums, inside) & used, origin);
}

double HeightSampler::height(std::int64_t i, std::int64_t j) noexcept {
  const double height = PlainTerrain::height(i, j);
  if (std::isfinite(height)) return height;
  sound = false;
  return 0;
}

double HeightSampler::surface(double x, double y) noexcept {
  return PlainTerrain::surface(x, y, [&](std::int64_t i, std::int64_t j) { return height(i, j); });
}

ShapeSample HeightSampler::nearest(const Eigen::Vector3d& x) noexcept {
  const double gap = x.z() - surface(x.x(), x.y());
  const exact::Point at = {x.x(), x.y(), x.z()};
  Eigen::Vector3d point(x.x(), x.y(), x.z() - gap);
  double best2 = gap * gap;
  const std::int64_t last[2] = {std::int64_t{columns} - 2, std::int64_t{rows} - 2};
  std::int64_t middle[2];
  for (int k = 0; k < 2; ++k)
    middle[k] = static_cast<std::int64_t>(
        std::clamp(std::floor(x[k] / spacing[k]), 0.0, static_cast<double>(last[k])));
  const auto try_cell = [&](std::int64_t i, std::int64_t j) {
    if (i < 0 || j < 0 || i > last[0] || j > last[1]) return;
    const auto corner = [&](std::int64_t a, std::int64_t b) {
      return exact::Point{static_cast<double>(a) * spacing[0], static_cast<double>(b) * spacing[1],
                          height(a, b)};
    };
    const exact::Point c[4] = {corner(i, j), corner(i + 1, j), corner(i + 1, j + 1),
                               corner(i, j + 1)};
    for (const int other : {1, 2}) {
      const exact::Point found =
          nearest_on_triangle(at, exact::FlatTriangle(c[0], c[other], c[other + 1]));
      const double d2 = dot(at - found, at - found);
      if (d2 >= best2) continue;
      best2 = d2;
      point = vector(found);
    }
  };
  // Visits rings of cells while one may be nearer, as all heights are within their bounds.
  const double apart = std::max({0.0, x.z() - highest, lowest - x.z()});
  const double step = std::min(spacing[0], spacing[1]);
  const std::int64_t most = std::max(last[0], last[1]) + 1;
  for (std::int64_t ring = 0; ring <= most; ++ring) {
    const double least = static_cast<double>(ring - 1) * step;
    if (least > 0 && least * least + apart * apart >= best2) break;
    for (std::int64_t i = -ring; i <= ring; ++i) {
      const bool side = i == -ring || i == ring;
      for (std::int64_t j = -ring; j <= ring; j += side || ring == 0 ? 1 : 2 * ring)
        try_cell(middle[0] + i, middle[1] + j);
    }
  }
  const double distance = std::sqrt(best2);
  const Eigen::Vector3d up =
      distance > 0 ? Eigen::Vector3d((x - point) / distance) : Eigen::Vector3d::UnitZ().eval();
  return gap > 0 ? ShapeSample{distance, up} : ShapeSample{-distance, -up};
}

void HeightSampler::add_cells(const ProbeBalls& balls, std::uint32_t used,
                              ProbeSums& sums) noexcept {
  PatchFiller filler(balls, used, sums);
  std::int64_t from[2], to[2];
  for (int k = 0; k < 2; ++k) cells_near(k, balls.origin[k], balls.reach, from[k], to[k]);
  const auto corner = [&](std::int64_t i, std::int64_t j, double(&p)[3]) {
    p[0] = point(0, i, balls.origin[0], balls.reach);
    p[1] = point(1, j, balls.origin[1], balls.reach);
    p[2] = height(i, j);
  };
  for (std::int64_t j = from[1]; j <= to[1]; ++j) {
    for (std::int64_t i = from[0]; i <= to[0]; ++i) {
      double a[3], b[3], c[3], d[3];
      corner(i, j, a), corner(i + 1, j, b), corner(i + 1, j + 1, c), corner(i, j + 1, d);
      const double top = std::max(std::max(a[2], b[2]), std::max(c[2], d[2]));
      const double bottom = std::min(std::min(a[2], b[2]), std::min(c[2], d[2]));
      if (balls.origin[2] - balls.reach > top || balls.origin[2] + balls.reach < bottom) continue;
      filler.add(a, b, c);
      filler.add(a, c, d);
    }
  }
  filler.flush();
}

ProbeTotal HeightSampler::block(const ProbeBalls& balls, std::uint32_t used,
                                const double (&origin)[3], std::uint32_t& pairs) noexcept {
  ProbeSums sums;
  add_cells(balls, used, sums);
  pairs += sums.pairs;
  const ProbeBalls seen = off_edges(balls, sums, [&](const ProbeBalls& moved, ProbeSums& there) {
    add_cells(moved, sums.on_edge, there);
  });
  std::uint32_t inside = 0;
  for (std::uint32_t i = 0; i < kWidth; ++i)
    inside |=
        seen.origin[2] + seen.z[i] < surface(seen.origin[0] + seen.x[i], seen.origin[1] + seen.y[i])
            ? 1u << i
            : 0u;
  return total_of(balls, sums, sides_by_angles(sums, inside) & used, origin);
}

}  // namespace ist
