#include "build/column_lattice.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace ist {
namespace {

constexpr double kGoldenRatio = 0.6180339887498949;  // the most irrational shift from row to row
constexpr double kMinColumnsAcross = 16;
constexpr double kMaxBoxColumns = 1u << 22;

Eigen::AlignedBox3d unit_box(const MeshSolid& solid) {
  const Eigen::AlignedBox3d box = solid.bounds();
  return {solid.frame().to_unit(box.min()), solid.frame().to_unit(box.max())};
}

/// Area of the solid's shadow along x, a point counted as often as a line enters the surface there.
double shadow_area(const MeshView& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
    const std::uint32_t* corner = mesh.triangles + 3 * t;
    const double* a = mesh.vertices_exact + 3 * std::size_t{corner[0]};
    const double* b = mesh.vertices_exact + 3 * std::size_t{corner[1]};
    const double* c = mesh.vertices_exact + 3 * std::size_t{corner[2]};
    sum += std::abs((b[1] - a[1]) * (c[2] - a[2]) - (c[1] - a[1]) * (b[2] - a[2]));
  }
  return sum / 4;  // half the parallelograms, and half of the crossings enter
}

/// The parts of a line where the winding number is ≥ 1.
void append_spans(const std::vector<Crossing>& crossings, std::vector<ColumnSpan>& spans) {
  int winding = 0;
  double enter = 0;
  for (const Crossing& crossing : crossings) {
    const int before = winding;
    winding += crossing.sign;
    if (before < 1 && winding >= 1) enter = crossing.x;
    if (before >= 1 && winding < 1 && crossing.x > enter) spans.push_back({enter, crossing.x});
  }
}

}  // namespace

double ColumnLattice::y(std::uint32_t i, std::uint32_t j) const {
  const double shift = 0.5 + j * kGoldenRatio;
  return box.min().y() + (i + (shift - std::floor(shift))) * step_y;
}

ColumnLattice cut_columns(const MeshSolid& solid, double step, double min_columns,
                          double max_columns) {
  ColumnLattice lattice;
  lattice.box = unit_box(solid);
  const double width = lattice.box.sizes().y(), depth = lattice.box.sizes().z();
  const double shadow = shadow_area(solid.arrays());
  for (double spacing = std::min(step, std::sqrt(shadow / min_columns));; spacing *= 1.05) {
    const double ny = std::max(kMinColumnsAcross, std::ceil(width / spacing));
    const double nz = std::max(kMinColumnsAcross, std::ceil(depth / spacing));
    lattice.step_y = width / ny;
    lattice.step_z = depth / nz;
    const bool few =
        ny * nz <= kMaxBoxColumns && shadow <= max_columns * lattice.step_y * lattice.step_z;
    if (!few && ny * nz > kMinColumnsAcross * kMinColumnsAcross) continue;
    lattice.ny = static_cast<std::uint32_t>(ny);
    lattice.nz = static_cast<std::uint32_t>(nz);
    break;
  }

  struct Row {
    std::vector<std::uint32_t> counts;
    std::vector<ColumnSpan> spans;
  };
  std::vector<Row> rows(lattice.nz);
  tbb::parallel_for(std::uint32_t{0}, lattice.nz, [&](std::uint32_t j) {
    std::vector<Crossing> crossings;
    Row& row = rows[j];
    row.counts.resize(lattice.ny);
    for (std::uint32_t i = 0; i < lattice.ny; ++i) {
      solid.line_crossings(lattice.y(i, j), lattice.z(j), crossings);
      const std::size_t before = row.spans.size();
      append_spans(crossings, row.spans);
      row.counts[i] = static_cast<std::uint32_t>(row.spans.size() - before);
    }
  });

  lattice.first.reserve(std::size_t{lattice.ny} * lattice.nz + 1);
  lattice.first.push_back(0);
  for (const Row& row : rows) {
    for (const std::uint32_t count : row.counts)
      lattice.first.push_back(lattice.first.back() + count);
    lattice.spans.insert(lattice.spans.end(), row.spans.begin(), row.spans.end());
  }
  for (const ColumnSpan& span : lattice.spans) lattice.length += span.x1 - span.x0;
  return lattice;
}

}  // namespace ist
