// Closest-point queries beside Embree's rtcPointQuery: the same float mesh, the same points, one
// thread, in turn. Embree's callback does what its own tutorial does: closest point of one
// triangle, radius shrunk on improvement.

#include <embree3/rtcore.h>

#include <ist/mesh.h>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "mesh/geometry/closest_point.h"
#include "mesh/mesh_solid.h"
#include "report.h"
#include "support/shared_data.h"
#include "timing.h"

namespace {

using ist::benchmark::Report;
using ist::benchmark::thread_seconds;
using ist::benchmark::wall_seconds;

struct Vec {
  float x, y, z;
};

Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator*(float s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
float dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Closest point of a triangle by its Voronoi regions (Ericson, Real-Time Collision
/// Detection, 5.1.5).
Vec closest_on_triangle(Vec p, Vec a, Vec b, Vec c) {
  const Vec ab = b - a, ac = c - a, ap = p - a;
  const float d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vec bp = p - b;
  const float d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const Vec cp = p - c;
  const float d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + (d1 / (d1 - d3)) * ab;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + (d2 / (d2 - d6)) * ac;
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return b + ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (c - b);
  const float scale = 1 / (va + vb + vc);
  return a + (vb * scale) * ab + (vc * scale) * ac;
}

struct EmbreeAnswer {
  const float* vertices;
  const std::uint32_t* triangles;
  Vec point;
  unsigned triangle;
};

bool visit_triangle(RTCPointQueryFunctionArguments* arguments) {
  auto& answer = *static_cast<EmbreeAnswer*>(arguments->userPtr);
  const std::uint32_t* t = answer.triangles + 3 * std::size_t{arguments->primID};
  const auto corner = [&](int i) {
    const float* v = answer.vertices + 3 * std::size_t{t[i]};
    return Vec{v[0], v[1], v[2]};
  };
  const Vec p = {arguments->query->x, arguments->query->y, arguments->query->z};
  const Vec q = closest_on_triangle(p, corner(0), corner(1), corner(2));
  const float d2 = dot(p - q, p - q);
  const float radius = arguments->query->radius;
  if (!(d2 < radius * radius)) return false;
  arguments->query->radius = std::sqrt(d2);
  answer.point = q;
  answer.triangle = arguments->primID;
  return true;
}

/// An Embree scene of the float mesh, best build quality.
class EmbreeScene {
 public:
  explicit EmbreeScene(const ist::MeshView& mesh) : mesh_(mesh) {
    device_ = rtcNewDevice("threads=1");
    scene_ = rtcNewScene(device_);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                             12, mesh.vertex_count);
    for (std::size_t k = 0; k < 3 * std::size_t{mesh.vertex_count}; ++k)
      vertices_.push_back(static_cast<float>(mesh.vertices[k]));
    std::copy(vertices_.begin(), vertices_.end(), static_cast<float*>(vertices));
    void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              12, mesh.triangle_count);
    std::copy_n(mesh.triangles, 3 * std::size_t{mesh.triangle_count},
                static_cast<std::uint32_t*>(triangles));
    rtcSetGeometryPointQueryFunction(geometry, visit_triangle);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  ~EmbreeScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  float distance(const float p[3]) const {
    RTCPointQuery query = {p[0], p[1], p[2], 0, std::numeric_limits<float>::infinity()};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    EmbreeAnswer answer = {vertices_.data(), mesh_.triangles, {}, 0};
    rtcPointQuery(scene_, &query, &context, nullptr, &answer);
    return query.radius;
  }

 private:
  const ist::MeshView& mesh_;
  std::vector<float> vertices_;
  RTCDevice device_;
  RTCScene scene_;
};

using Points = std::vector<std::array<float, 3>>;

Points points_in_box(const ist::MeshView& mesh, std::size_t count) {
  float lower[3], upper[3];
  for (std::size_t k = 0; k < 3; ++k) {
    lower[k] = upper[k] = static_cast<float>(mesh.vertices[k]);
    for (std::size_t v = 0; v < mesh.vertex_count; ++v) {
      const auto x = static_cast<float>(mesh.vertices[3 * v + k]);
      lower[k] = std::min(lower[k], x);
      upper[k] = std::max(upper[k], x);
    }
  }
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  Points points(count);
  for (auto& p : points)
    for (std::size_t k = 0; k < 3; ++k) p[k] = lower[k] + unit(random) * (upper[k] - lower[k]);
  return points;
}

/// Off random triangles by up to 1 % of the unit frame.
Points points_near_surface(const ist::MeshView& mesh, std::size_t count) {
  std::mt19937 random(2);
  std::uniform_int_distribution<std::uint32_t> pick(0, mesh.triangle_count - 1);
  std::uniform_real_distribution<float> offset(-0.01f, 0.01f);
  Points points(count);
  for (auto& p : points) {
    const std::uint32_t v = mesh.triangles[3 * std::size_t{pick(random)}];
    for (std::size_t k = 0; k < 3; ++k)
      p[k] = static_cast<float>(mesh.vertices[3 * std::size_t{v} + k]) + offset(random);
  }
  return points;
}

/// [s] the least thread time of several rounds; adds up answers so that none is left out.
template <class Query>
double best_seconds(const Points& points, int rounds, double& sum, Query&& query) {
  double best = std::numeric_limits<double>::infinity();
  for (int round = 0; round < rounds; ++round) {
    const double start = thread_seconds();
    for (const auto& p : points) sum += static_cast<double>(query(p));
    best = std::min(best, thread_seconds() - start);
  }
  return best;
}

void compare(Report& report, const std::string& name, const std::string& file) {
  const ist::ClosedMesh closed =
      ist::close_mesh(ist::load_mesh(ist::testing::shared_path(file).string()), name);
  const double start = wall_seconds();
  const ist::MeshSolid solid(closed);
  const double build_seconds = wall_seconds() - start;
  const ist::MeshView& mesh = solid.view();
  const EmbreeScene embree(mesh);
  const std::size_t count = report.quick() ? 20'000 : 200'000;
  const int rounds = report.quick() ? 2 : 3;
  const std::pair<const char*, Points> sets[] = {
      {"in the bounding box", points_in_box(mesh, count)},
      {"near the surface", points_near_surface(mesh, count)}};
  for (const auto& [where, points] : sets) {
    double worst = 0;
    for (std::size_t i = 0; i < points.size(); i += 17) {
      const float ours = std::sqrt(ist::nearest_triangle(mesh, points[i].data()).distance2);
      worst = std::max(worst, std::abs(double(ours) - double(embree.distance(points[i].data()))));
    }
    double sum = 0;
    const double peer =
        best_seconds(points, rounds, sum, [&](const auto& p) { return embree.distance(p.data()); });
    const double ours = best_seconds(points, rounds, sum, [&](const auto& p) {
      return ist::nearest_triangle(mesh, p.data()).distance2;
    });
    const double exact = best_seconds(points, rounds, sum, [&](const auto& p) {
      return solid.closest_point(Eigen::Vector3d(p[0], p[1], p[2])).distance;
    });
    const double winding = best_seconds(points, rounds, sum, [&](const auto& p) {
      return solid.winding_number(Eigen::Vector3d(p[0], p[1], p[2]));
    });
    const double n = static_cast<double>(points.size());
    report.row("closest point, one thread", {{"mesh", name},
                                             {"triangles", mesh.triangle_count},
                                             {"points", where},
                                             {"embree_us", 1e6 * peer / n},
                                             {"ist_us", 1e6 * ours / n},
                                             {"ist_exact_us", 1e6 * exact / n},
                                             {"ist_winding_us", 1e6 * winding / n},
                                             {"ratio", peer / ours},
                                             {"ratio_exact", peer / exact},
                                             {"largest_difference", worst},
                                             {"solid_build_s", build_seconds},
                                             {"checksum", sum}});
    report.target("speed over Embree, " + name + ", points " + where, peer / ours, 0.8);
  }
}

}  // namespace

int main(int argc, char** argv) {
  Report report("closest_point_embree", argc, argv);
  report.remark("Least thread CPU time of several rounds; ratio > 1: faster than Embree " +
                std::string(RTC_VERSION_STRING) + ". Exact: double closest point.");
  compare(report, "dino", "oracle/meshes/dino.off");
  compare(report, "dragon_871k", "meshes/dev/dragon_871k.ply");
  compare(report, "fish_hr_539k", "meshes/dev/fish_hr_539k.ply");
  return report.write();
}
