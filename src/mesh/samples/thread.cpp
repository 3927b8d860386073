#include <algorithm>
#include <array>

#include "mesh/samples/mesh_builder.h"
#include "mesh/samples/samples.h"
#include "mesh/samples/shapes.h"

// A thread is the surface r = profile(z / pitch − θ / 2π) about the z axis. It is cut into columns
// at fixed θ; a column has a vertex at every corner of the profile, so that the mesh's edges run
// along the helix, and one at each end of the thread.

namespace ist::shapes {
namespace {

constexpr std::size_t kColumns = 60;  // a multiple of six: every corner of a hexagon has a column
constexpr double kHexagon = 7.5;      // half the width across flats

/// Fractions of a pitch at which the profile has its corners: root, flank, crest, flank.
constexpr std::array kCorners = {0.1, 0.5, 0.6, 1.0};

double profile(double turns) {
  const double u = turns - std::floor(turns);
  if (u < kCorners[0]) return kThreadMinor;
  const double up = (u - kCorners[0]) / (kCorners[1] - kCorners[0]);
  const double down = (kCorners[3] - u) / (kCorners[3] - kCorners[2]);
  return kThreadMinor + (kThreadMajor - kThreadMinor) * std::min({1.0, up, down});
}

double hexagon(std::size_t i) {
  constexpr std::size_t kSide = kColumns / 6;
  const double angle = std::numbers::pi / 3 * (static_cast<double>(i % kSide) / kSide - 0.5);
  return kHexagon / std::cos(angle);
}

struct Column {
  std::vector<double> z;
  std::vector<std::uint32_t> vertex;
};

Column add_column(MeshBuilder& builder, std::size_t i, double bottom, double top,
                  double clearance) {
  constexpr double kTolerance = 1e-6;  // a corner this close to an end is the end
  const double turn = static_cast<double>(i) / kColumns;
  Column column;
  const auto add = [&](double z) {
    const double r = profile(z / kThreadPitch - turn + 1e-12) + clearance;
    const double angle = 2 * std::numbers::pi * turn;
    column.z.push_back(z);
    column.vertex.push_back(builder.vertex(r * std::cos(angle), r * std::sin(angle), z));
  };
  add(bottom);
  for (double k = std::floor(bottom / kThreadPitch) - 2; k * kThreadPitch < top; ++k)
    for (const double corner : kCorners) {
      const double z = kThreadPitch * (k + corner + turn);
      if (z > bottom + kTolerance && z < top - kTolerance) add(z);
    }
  add(top);
  return column;
}

/// Adds a thread's wall between two heights; returns its lower and upper ring.
std::pair<Ring, Ring> add_thread(MeshBuilder& builder, double bottom, double top, double clearance,
                                 bool inward) {
  std::vector<Column> columns;
  for (std::size_t i = 0; i < kColumns; ++i)
    columns.push_back(add_column(builder, i, bottom, top, clearance));

  const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    inward ? builder.triangle(a, c, b) : builder.triangle(a, b, c);
  };
  std::pair<Ring, Ring> rings;
  for (std::size_t i = 0; i < kColumns; ++i) {
    const Column& left = columns[i];
    const Column& right = columns[(i + 1) % kColumns];
    rings.first.push_back(left.vertex.front());
    rings.second.push_back(left.vertex.back());
    // Climb both columns; the step goes to the side whose next vertex comes first along the
    // thread, where the right column is 1/kColumns of a turn ahead.
    std::size_t a = 0, b = 0;
    while (a + 1 < left.z.size() || b + 1 < right.z.size()) {
      const bool left_done = a + 1 == left.z.size();
      const bool right_done = b + 1 == right.z.size();
      if (right_done ||
          (!left_done && left.z[a + 1] < right.z[b + 1] - kThreadPitch / kColumns + 1e-9)) {
        triangle(left.vertex[a], right.vertex[b], left.vertex[a + 1]);
        ++a;
      } else {
        triangle(left.vertex[a], right.vertex[b], right.vertex[b + 1]);
        ++b;
      }
    }
  }
  return rings;
}

}  // namespace

TriangleMesh bolt() {
  constexpr double kThreadLength = 16, kHeadHeight = 5;
  MeshBuilder builder;
  const auto [tip, neck] = add_thread(builder, 0, kThreadLength, 0, false);
  const Ring head_low = builder.ring(kColumns, kThreadLength, hexagon);
  const Ring head_high = builder.ring(kColumns, kThreadLength + kHeadHeight, hexagon);
  builder.cap_down(tip, builder.vertex(0, 0, 0));
  builder.wall(neck, head_low);
  builder.wall(head_low, head_high);
  builder.cap_up(head_high, builder.vertex(0, 0, kThreadLength + kHeadHeight));
  return builder.take();
}

TriangleMesh nut() {
  constexpr double kHalfHeight = 4;
  MeshBuilder builder;
  const auto [bore_low, bore_high] =
      add_thread(builder, -kHalfHeight, kHalfHeight, kThreadClearance, true);
  const Ring low = builder.ring(kColumns, -kHalfHeight, hexagon);
  const Ring high = builder.ring(kColumns, kHalfHeight, hexagon);
  builder.wall(bore_low, low);
  builder.wall(low, high);
  builder.wall(high, bore_high);
  return builder.take();
}

}  // namespace ist::shapes
