#include "packing/calibrate/column_lattice.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <algorithm>
#include <atomic>
#include <cmath>

#include "mesh/geometry/exact_triangle.h"

namespace ist {
namespace {

constexpr double kMinColumnsAcross = 16;
constexpr double kMaxBoxColumns = 1u << 22;

/// Area of the solid's projection along x, weighted by the number of entries into the surface.
/// Summed in integers, so in any order.
double shadow_area(const MeshView& mesh) {
  constexpr double kUnit = 0x1p-50;
  using Range = tbb::blocked_range<std::uint32_t>;
  const std::uint64_t sum = tbb::parallel_reduce(
      Range(0, mesh.triangle_count), std::uint64_t{0},
      [&](const Range& range, std::uint64_t part) {
        for (std::uint32_t t = range.begin(); t != range.end(); ++t) {
          const Corners corner = corners_of(mesh, t);
          const double *a = corner.p[0], *b = corner.p[1], *c = corner.p[2];
          part += static_cast<std::uint64_t>(
              std::abs((b[1] - a[1]) * (c[2] - a[2]) - (c[1] - a[1]) * (b[2] - a[2])) / kUnit);
        }
        return part;
      },
      [](std::uint64_t a, std::uint64_t b) { return a + b; });
  return static_cast<double>(sum) * kUnit /
         4;  // half the parallelograms; half the crossings are entries
}

}  // namespace

ColumnPlan plan_columns(const MeshSolid& solid, double step, double min_columns,
                        double max_columns) {
  const Eigen::Vector3d lower = solid.frame().to_unit(solid.bounds().min());
  const Eigen::Vector3d upper = solid.frame().to_unit(solid.bounds().max());
  const double width = upper.y() - lower.y(), depth = upper.z() - lower.z();
  const double shadow = shadow_area(solid.arrays());
  ColumnPlan plan;
  plan.x0 = lower.x();
  plan.x1 = upper.x();
  LineLattice& lines = plan.lines;
  lines.y0 = lower.y();
  lines.z0 = lower.z();
  lines.offset = 0.5;
  lines.shift = kGoldenRatio;
  for (double spacing = std::min(step, std::sqrt(shadow / min_columns));; spacing *= 1.05) {
    const double ny = std::max(kMinColumnsAcross, std::ceil(width / spacing));
    const double nz = std::max(kMinColumnsAcross, std::ceil(depth / spacing));
    lines.step_y = width / ny;
    lines.step_z = depth / nz;
    const bool few = ny * nz <= kMaxBoxColumns && shadow <= max_columns * plan.cross_section();
    if (!few && ny * nz > kMinColumnsAcross * kMinColumnsAcross) continue;
    lines.ny = static_cast<std::uint32_t>(ny);
    lines.nz = static_cast<std::uint32_t>(nz);
    return plan;
  }
}

ColumnLattice cut_columns(const MeshSolid& solid, const ColumnPlan& plan) {
  ColumnLattice lattice{plan, {}, {}, 0};
  lattice.first = {0};
  std::uint64_t length = 0;
  cross_lattice(solid.arrays(), plan.lines, [&](std::uint32_t, const LatticeCrossings& cut) {
    const auto for_spans_of = [&](std::size_t line, const auto& add) {
      for_spans(cut[line].data(), static_cast<std::uint32_t>(cut[line].size()), add);
    };
    const std::size_t before = lattice.first.size() - 1, lines = cut.size();
    lattice.first.resize(before + lines + 1);
    std::uint32_t* const first = &lattice.first[before];
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, lines), [&](const auto& range) {
      std::uint64_t part = 0;
      for (std::size_t line = range.begin(); line != range.end(); ++line)
        for_spans_of(line, [&](const ColumnSpan& span) {
          ++first[line + 1];
          part += length_units(span);
        });
      std::atomic_ref<std::uint64_t>(length).fetch_add(part, std::memory_order_relaxed);
    });
    for (std::size_t line = 0; line < lines; ++line) first[line + 1] += first[line];
    lattice.spans.resize(first[lines]);
    tbb::parallel_for(std::size_t{0}, lines, [&](std::size_t line) {
      std::uint32_t next = first[line];
      for_spans_of(line, [&](const ColumnSpan& span) { lattice.spans[next++] = span; });
    });
  });
  lattice.length = static_cast<double>(length) * kLengthUnit;
  return lattice;
}

}  // namespace ist
