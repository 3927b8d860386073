#include "mesh/mesh_solid.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <algorithm>
#include <atomic>
#include <cmath>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "mesh/geometry/closest_point.h"
#include "mesh/geometry/exact_triangle.h"
#include "mesh/hierarchy/winding.h"

namespace ist {
namespace {

/// Bound on the distance by which to_unit() moves a point by rounding; 0 only if it does not round.
double rounding_at(const UnitFrame& frame, double scale, const Eigen::Vector3d& x) {
  double off[3], largest = 0;
  for (int k = 0; k < 3; ++k) {
    const double difference = x[k] - frame.centre[k];
    const double centre_part =
        difference - x[k];  // the part of −centre that was added (Knuth's two-sum)
    const double tail =
        (x[k] - (difference - centre_part)) + (-frame.centre[k] - centre_part);  // exact
    off[k] = std::abs(tail) / scale;  // division by a power of two: exact unless it underflows
    if (tail != 0 || difference / scale * scale != difference)
      off[k] += std::numeric_limits<double>::denorm_min();
    largest = std::max(largest, off[k]);
  }
  if (largest == 0) return 0;
  for (double& part : off) part /= largest;
  return std::sqrt(off[0] * off[0] + off[1] * off[1] + off[2] * off[2]) * largest * (1 + 1e-15);
}

/// Hash over the frame, the counts, the vertices and the triangles.
std::uint64_t hash_mesh(const UnitFrame& frame, const RawArray<double>& vertices,
                        const RawArray<std::uint32_t>& triangles) {
  struct Head {
    double centre[3];
    std::int64_t exponent;
    std::uint64_t vertices, triangles;
  };
  const Head head = {{frame.centre.x(), frame.centre.y(), frame.centre.z()},
                     frame.exponent,
                     vertices.size(),
                     triangles.size()};
  XXH3_state_t* state = XXH3_createState();
  XXH3_64bits_reset(state);
  XXH3_64bits_update(state, &head, sizeof head);
  XXH3_64bits_update(state, vertices.data(), vertices.size() * sizeof(double));
  XXH3_64bits_update(state, triangles.data(), triangles.size() * sizeof(std::uint32_t));
  const std::uint64_t hash = XXH3_64bits_digest(state);
  XXH3_freeState(state);
  return hash;
}

/// Closest point by the double formula over every triangle, the smaller index among equals. The
/// float hierarchy and the float distances only exclude triangles, with a margin for their error.
/// If nothing is closer than `limit`: distance = limit, triangle = kNoTriangle.
ClosestPoint exact_closest_point(const MeshView& mesh, const Eigen::Vector3d& p, double limit) {
  const ExactReach reach(p.data());
  ClosestPoint best;
  best.distance = limit;
  best.triangle = kNoTriangle;
  double best2 = limit * limit;
  float radius2 = reach.reach2(best2);
  for_triangles_near(mesh, reach.p, radius2, [&](const NearTriangle& near) {
    const std::uint32_t* t = mesh.triangles + 3 * std::size_t{near.triangle};
    const auto corner = [&](int i) { return mesh.vertices + 3 * std::size_t{t[i]}; };
    double point[3];
    const double distance2 = exact_closest_in({corner(0), corner(1), corner(2)}, p.data(), point);
    if (distance2 < best2 ||
        (distance2 == best2 && near.triangle < best.triangle && best.triangle != kNoTriangle)) {
      best2 = distance2;
      best.triangle = near.triangle;
      best.point = {point[0], point[1], point[2]};
      radius2 = reach.reach2(best2);
    }
    return radius2;
  });
  if (best.triangle != kNoTriangle) best.distance = std::sqrt(best2);
  return best;
}

}  // namespace

MeshSolid::MeshSolid(const ClosedMesh& closed) {
  const TriangleMesh& mesh = closed.mesh;
  if (mesh.triangles.empty())
    throw Error(closed.name + ": no triangles, so it does not bound a solid");
  if (mesh.triangles.size() >= kBvhLeaf / 2)
    throw Error(closed.name + ": more than 2^30 triangles: simplify the mesh");
  // Only referenced vertices count; others may be anywhere, even at NaN.
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> place(mesh.vertices.size(), kUnused);
  tbb::parallel_for(std::size_t{0}, mesh.triangles.size(), [&](std::size_t t) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (v >= mesh.vertices.size())
        throw Error(closed.name + ": a triangle refers to a vertex that does not exist");
      std::atomic_ref<std::uint32_t>(place[v]).store(0, std::memory_order_relaxed);
    }
  });
  std::uint32_t count = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (place[v] == kUnused) continue;
    place[v] = count++;
    bounds_.extend(mesh.vertices[v]);
  }
  frame_ = unit_frame(bounds_);
  vertices_ = RawArray<double>(3 * std::size_t{count});
  using Range = tbb::blocked_range<std::size_t>;
  rounding_ = tbb::parallel_reduce(
      Range(0, mesh.vertices.size()), 0.0,
      [&](const Range& range, double most) {
        const double scale = frame_.scale();
        for (std::size_t v = range.begin(); v != range.end(); ++v) {
          if (place[v] == kUnused) continue;
          const Eigen::Vector3d x = frame_.to_unit(mesh.vertices[v]);
          for (std::size_t k = 0; k < 3; ++k)
            vertices_[3 * std::size_t{place[v]} + k] = x[static_cast<int>(k)];
          most = std::max(most, rounding_at(frame_, scale, mesh.vertices[v]));
        }
        return most;
      },
      [](double a, double b) { return std::max(a, b); });
  triangles_ = RawArray<std::uint32_t>(3 * mesh.triangles.size());
  tbb::parallel_for(std::size_t{0}, mesh.triangles.size(), [&](std::size_t t) {
    for (std::size_t k = 0; k < 3; ++k) triangles_[3 * t + k] = place[mesh.triangles[t][k]];
  });

  arrays_.vertices = vertices_.data();
  arrays_.triangles = triangles_.data();
  arrays_.vertex_count = count;
  arrays_.triangle_count = static_cast<std::uint32_t>(mesh.triangles.size());
  meets_itself_ = closed.report.meets_itself;
  if (closed.meeting_pairs) {
    for (const auto& pair : *closed.meeting_pairs)
      if (pair[0] >= mesh.triangles.size() || pair[1] >= mesh.triangles.size())
        throw Error(closed.name + ": meeting pairs refer to a triangle that does not exist");
    if (rounding_ == 0) meeting_pairs_ = closed.meeting_pairs;
  }
  may_overlap_ = closed.report.meets_itself || closed.report.shells != 1;
  moved_ = rounding_;
}

MeshSolid::MeshSolid(const ResolvedMesh& resolved) : MeshSolid(resolved.mesh) {
  if (resolved.resolution.how == Resolution::How::unresolved) return;
  meets_itself_ = may_overlap_ = false;
  moved_ += resolved.resolution.moved / frame_.scale();
}

double MeshSolid::signed_distance(const Eigen::Vector3d& x) const {
  const Eigen::Vector3d unit = frame_.to_unit(x);
  const double distance = closest_point(unit).distance * frame_.scale();
  return inside(unit) ? -distance : distance;
}

double MeshSolid::volume() const {
  const double scale = frame_.scale();
  return unit_volume() * scale * scale * scale;
}

double MeshSolid::volume_error() const {
  const double scale = frame_.scale();
  return unit_moments().volume_error * scale * scale * scale;
}

const MeshView& MeshSolid::view() const {
  oneapi::tbb::collaborative_call_once(hierarchy_made_, [this] {
    bvh_ = build_bvh(vertices_, triangles_);
    view_ = arrays_;
    view_.nodes = bvh_.nodes.get();
    view_.blocks = bvh_.blocks.get();
    view_.root = bvh_.root;
    view_.oriented = bvh_.oriented.get();
  });
  return view_;
}

const MeshMoments& MeshSolid::unit_moments() const {
  // A single shell without self-intersections winds around no point twice.
  oneapi::tbb::collaborative_call_once(moments_made_, [this] {
    const HierarchyMaker hierarchy = [this]() -> const MeshView& { return view(); };
    moments_ = may_overlap_ ? winding_set_moments(arrays_, meets_itself_, hierarchy)
                            : enclosed_moments(arrays_);
    if (!(moved_ > rounding_)) return;
    moments_ = moments_near(arrays_, moments_, moved_);
    moments_.volume_error += slab_volume(arrays_, moved_);
  });
  return moments_;
}

std::uint64_t MeshSolid::hash() const {
  oneapi::tbb::collaborative_call_once(
      hash_made_, [this] { hash_ = hash_mesh(frame_, vertices_, triangles_); });
  return hash_;
}

ClosestPoint MeshSolid::closest_point(const Eigen::Vector3d& unit, double limit) const {
  return exact_closest_point(view(), unit, limit);
}

int MeshSolid::winding_number(const Eigen::Vector3d& unit) const {
  return ist::winding_number(view(), unit.data());
}

std::unique_ptr<Solid> make_solid(const ClosedMesh& mesh) {
  return std::make_unique<MeshSolid>(resolve(mesh));
}

double UnitFrame::scale() const { return std::ldexp(1.0, exponent); }

UnitFrame unit_frame(const Eigen::AlignedBox3d& bounds) {
  if (bounds.isEmpty() || !bounds.min().allFinite() || !bounds.max().allFinite())
    throw Error("the bounding box is empty or not finite, so there is no solid");
  // Halved first: the sum of two large coordinates may overflow.
  const Eigen::Vector3d half = bounds.max() / 2 - bounds.min() / 2;
  const double half_extent = half.maxCoeff();
  if (!(half_extent > 0)) throw Error("the bounding box has size 0, so there is no solid");
  UnitFrame frame;
  frame.centre = bounds.min() / 2 + bounds.max() / 2;
  const double mantissa = std::frexp(half_extent, &frame.exponent);
  if (mantissa == 0.5) --frame.exponent;  // half-extent exactly 1, not ½
  return frame;
}

}  // namespace ist
