#include "robots/covers/offset_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_set>

#include "mesh/connectivity/edge_table.h"
#include "robots/covers/point_grid.h"
#include "robots/covers/triangles.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr double kLongestRay = 4;  ///< unit frame: beyond any protrusion
constexpr double kSharp = 0.85;  ///< cosine between faces whose common edge is an edge of the solid
constexpr double kOff = 1e-6;    ///< unit frame: a step off the surface
constexpr double kTight = 0.5;   ///< share of the level: less is sampled more densely
constexpr std::size_t kMostInside = 1500;

struct Face {
  std::array<Vector3d, 3> corners;
  Vector3d normal;  ///< unit length, outward
  double area = 0;
};

std::vector<Face> faces_of(const MeshView& mesh) {
  std::vector<Face> faces(mesh.triangle_count);
  for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
    Face& face = faces[t];
    face.corners = triangle_corners(mesh, t);
    const Vector3d across =
        (face.corners[1] - face.corners[0]).cross(face.corners[2] - face.corners[0]);
    const double length = std::sqrt(across.squaredNorm());
    face.area = length / 2;
    face.normal = length > 0 ? Vector3d(across / length) : Vector3d::UnitX();
  }
  return faces;
}

/// Records places by grid cell and the side that they face.
class Thinning {
 public:
  explicit Thinning(double cell) : cell_(cell) {}

  bool is_new(const Vector3d& p, const Vector3d& normal) {
    std::uint64_t side = 0;
    for (int k = 0; k < 3; ++k) {
      side = 3 * side + (normal[k] > 0.4 ? 2u : normal[k] < -0.4 ? 0u : 1u);
    }
    return seen_.insert(mixed(cell_key(p, cell_) ^ (side << 40))).second;
  }

 private:
  double cell_;
  std::unordered_set<std::uint64_t> seen_;
};

struct Sample {
  Vector3d point, normal;
  double share = 1;
};

/// Middles of the parts of a face, halved across its longest side until no side exceeds `longest`.
void sample_face(const Face& face, double longest, Thinning& thinning, std::vector<Sample>& out) {
  std::vector<HalvableTriangle> open = {face.corners};
  while (!open.empty()) {
    const HalvableTriangle t = open.back();
    open.pop_back();
    const LongestSide side = longest_side(t);
    if (side.length2 <= longest * longest) {
      const Vector3d middle = (t[0] + t[1] + t[2]) / 3;
      if (thinning.is_new(middle, face.normal)) out.push_back({middle, face.normal});
      continue;
    }
    for (const HalvableTriangle& half : halves(t, side.from)) open.push_back(half);
  }
}

struct EdgeSamples {
  std::vector<Vector3d> points;
  std::vector<Sample> fans;  ///< directions between the two faces' normals
};

/// Points on edges where faces meet at an angle, and at their ends.
EdgeSamples sample_edges(const MeshView& mesh, const std::vector<Face>& faces, double spacing) {
  std::vector<Triangle> triangles(mesh.triangle_count);
  for (std::uint32_t t = 0; t < mesh.triangle_count; ++t)
    for (std::size_t k = 0; k < 3; ++k) triangles[t][k] = mesh.triangles[3 * std::size_t{t} + k];
  const EdgeTable edges(triangles);
  EdgeSamples out;
  Thinning thinning(0.9 * spacing);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto sides = edges.sides(e);
    if (sides.size() < 2) continue;
    const Vector3d n = faces[sides[0] / 3].normal, m = faces[sides[1] / 3].normal;
    if (sides.size() == 2 && n.dot(m) > kSharp) continue;
    const auto at = [&](std::size_t v) {
      return Vector3d(Eigen::Map<const Vector3d>(mesh.vertices + 3 * v));
    };
    const Vector3d a = at(edges.low(e)), b = at(edges.high(e));
    const double length = std::sqrt((b - a).squaredNorm());
    const int pieces = std::max(1, static_cast<int>(std::ceil(length / spacing)));
    Vector3d between = n + m;
    const double size = std::sqrt(between.squaredNorm());
    between = size > 1e-3 ? Vector3d(between / size) : n;
    for (int i = 0; i <= pieces; ++i) {
      const Vector3d p = a + (b - a) * (static_cast<double>(i) / pieces);
      if (!thinning.is_new(p, between)) continue;
      out.points.push_back(p);
      out.fans.push_back({p, between});
    }
  }
  return out;
}

/// The distance up to which the ray's foot is the surface's nearest point: a ball that touches the
/// foot and contains no other point of the mesh.
double reach_of(const MeshSolid& solid, const Sample& sample) {
  double radius = kLongestRay;
  for (int step = 0; step < 12; ++step) {
    const ClosestPoint near =
        solid.closest_point(sample.point + radius * sample.normal, radius * (1 - 1e-7));
    if (near.triangle == kNoTriangle) return radius;
    const Vector3d d = near.point - sample.point;
    const double along = d.dot(sample.normal);
    if (!(along > 0)) return radius * (1 - 1e-7);
    const double smaller = d.squaredNorm() / (2 * along);
    if (!(smaller < radius * (1 - 1e-6))) return std::min(smaller, radius);
    radius = smaller;
    if (radius < kOff) return 0;
  }
  return radius;
}

std::vector<OutwardRay> rays_of(const MeshSolid& solid, const std::vector<Sample>& samples) {
  std::vector<OutwardRay> rays(samples.size());
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
    const Sample& s = samples[i];
    rays[i] = {s.point, s.normal, 0, s.share};
    if (solid.may_overlap() && solid.inside(s.point + kOff * s.normal)) return;
    rays[i].reach = reach_of(solid, s);
  });
  std::erase_if(rays, [](const OutwardRay& ray) { return !(ray.reach > 0); });
  return rays;
}

/// Points of a lattice that lie inside.
std::vector<Vector3d> points_inside(const MeshSolid& solid, double spacing) {
  const Eigen::AlignedBox3d bounds = solid.bounds();
  const Vector3d low = solid.frame().to_unit(bounds.min()),
                 high = solid.frame().to_unit(bounds.max());
  const Vector3d size = high - low;
  double step = spacing;
  while (size.x() / step * (size.y() / step) * (size.z() / step) > 2.0 * kMostInside) step *= 1.1;
  std::vector<Vector3d> lattice;
  for (double z = low.z() + step / 2; z < high.z(); z += step)
    for (double y = low.y() + step / 2; y < high.y(); y += step)
      for (double x = low.x() + step / 2; x < high.x(); x += step) lattice.emplace_back(x, y, z);
  std::vector<char> inside(lattice.size());
  tbb::parallel_for(std::size_t{0}, lattice.size(),
                    [&](std::size_t i) { inside[i] = solid.inside(lattice[i]); });
  std::vector<Vector3d> out;
  for (std::size_t i = 0; i < lattice.size(); ++i)
    if (inside[i]) out.push_back(lattice[i]);
  return out;
}

}  // namespace

SampledSolid sample_solid(const MeshSolid& solid, std::size_t targets, LevelShare share) {
  const MeshView& mesh = solid.view();
  const std::vector<Face> faces = faces_of(mesh);
  double area = 0;
  for (const Face& face : faces) area += face.area;
  SampledSolid out;
  out.spacing = std::sqrt(area / static_cast<double>(targets));
  out.share = std::move(share);
  EdgeSamples edges = sample_edges(mesh, faces, out.spacing / 2);
  std::vector<Sample> coarse, fine;
  Thinning thin_coarse(out.spacing), thin_fine(out.spacing / 2);
  for (const Face& face : faces) {
    sample_face(face, out.spacing, thin_coarse, coarse);
    sample_face(face, out.spacing / 2, thin_fine, fine);
  }
  if (out.share)
    for (auto* samples : {&coarse, &fine, &edges.fans})
      tbb::parallel_for(std::size_t{0}, samples->size(), [&](std::size_t i) {
        Sample& s = (*samples)[i];
        s.share = out.share(s.point, s.normal);
      });
  for (const Sample& s : fine)
    if (s.share < kTight) out.targets.push_back(s.point);
  out.tight = out.targets.size();
  // Balls near edges are small, so rays are denser there; elsewhere as dense as targets.
  const PointGrid on_edges(edges.points);
  const double close = 3 * out.spacing;
  std::erase_if(fine, [&](const Sample& s) {
    bool is_close = s.share < kTight;
    on_edges.within(s.point, close * (1 + 1e-5) + 1e-6, [&](std::uint32_t place, float) {
      const Vector3d& p = edges.points[on_edges.index(place)];
      is_close |= (p - s.point).squaredNorm() < close * close;
    });
    return !is_close;
  });
  fine.insert(fine.end(), coarse.begin(), coarse.end());
  fine.insert(fine.end(), edges.fans.begin(), edges.fans.end());
  out.rays = rays_of(solid, fine);
  for (const Sample& s : coarse) out.targets.push_back(s.point);
  out.targets.insert(out.targets.end(), edges.points.begin(), edges.points.end());
  const std::vector<Vector3d> inside = points_inside(solid, 2 * out.spacing);
  out.targets.insert(out.targets.end(), inside.begin(), inside.end());
  return out;
}

}  // namespace ist
