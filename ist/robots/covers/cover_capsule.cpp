#include <ist/cover_spheres.h>
#include <ist/types.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>

#include "base/thread_arena.h"

namespace ist {
namespace {

using Eigen::Vector3d;

double volume_of(double radius, double length) {
  return std::numbers::pi * radius * radius * (length + 4 * radius / 3);
}

double volume_of(const CoverCapsule& c) { return volume_of(c.radius, (c.end - c.begin).norm()); }

/// A line through the solid's middle, and the excess width of the capsule around it:
using Axis = std::array<double, 5>;  ///< turns of the start axis about two others, offsets along
                                     ///< these, share by which the radius grows

/// The shortest capsule with that axis that contains all points.
class Fit {
 public:
  Fit(std::span<const Vector3d> points, const Vector3d& middle, double size,
      const Eigen::Matrix3d& start)
      : points_(points), middle_(middle), size_(size), start_(start) {}

  CoverCapsule at(const Axis& x) const {
    const Vector3d along =
        (start_.col(0) + x[0] * start_.col(1) + x[1] * start_.col(2)).normalized();
    const Vector3d from = middle_ + size_ * (x[2] * start_.col(1) + x[3] * start_.col(2));
    double most = 0;
    for (const Vector3d& p : points_) most = std::max(most, beside(p - from, along));
    const double square = most * (1 + x[4] * x[4]) * (1 + x[4] * x[4]);
    double low = std::numeric_limits<double>::infinity(), high = -low;  // of the segment's ends
    for (const Vector3d& p : points_) {
      const double t = (p - from).dot(along);
      const double half = std::sqrt(std::max(0.0, square - beside(p - from, along)));
      low = std::min(low, t + half);
      high = std::max(high, t - half);
    }
    if (low > high) low = high = (low + high) / 2;
    return {from + low * along, from + high * along, std::sqrt(square)};
  }
  double volume(const Axis& x) const { return volume_of(at(x)); }

 private:
  static double beside(const Vector3d& d, const Vector3d& along) {
    return (d - d.dot(along) * along).squaredNorm();
  }

  const std::span<const Vector3d> points_;
  const Vector3d middle_;
  const double size_;
  const Eigen::Matrix3d start_;
};

/// Steps along each number as long as that improves by a share `gain`, then takes shorter steps.
/// Around a flat layer ever smaller steps towards infinity would always improve, so their number is
/// limited.
Axis improved(const Fit& fit, double finest, double gain) {
  constexpr int kMostRounds = 24;
  Axis best = {0, 0, 0, 0, 0};
  double least = fit.volume(best);
  for (double step = 0.25; step > finest; step /= 2) {
    bool better = true;
    for (int round = 0; better && round < kMostRounds; ++round) {
      better = false;
      for (std::size_t k = 0; k < best.size(); ++k)
        for (const double sign : {-1.0, 1.0}) {
          Axis tried = best;
          tried[k] += sign * step;
          const double volume = fit.volume(tried);
          if (!(volume < least * (1 - gain))) continue;
          best = tried;
          least = volume;
          better = true;
        }
    }
  }
  return best;
}

Eigen::Matrix3d principal_axes(std::span<const Vector3d> points) {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : points) spread += (p - mean) * (p - mean).transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
}

/// A capsule that contains all points, with about the least volume. `rough`: in a tenth of the
/// time.
CoverCapsule capsule_around(std::span<const Vector3d> points, bool rough = false) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& p : points) box.extend(p);
  const double size = box.diagonal().norm() / 2;
  const Eigen::Matrix3d starts[] = {principal_axes(points), Eigen::Matrix3d::Identity()};
  CoverCapsule best;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Matrix3d& axes : std::span(starts, rough ? 1 : 2))
    for (int k = 0; k < 3; ++k) {
      Eigen::Matrix3d start;
      start << axes.col(k), axes.col((k + 1) % 3), axes.col((k + 2) % 3);
      const Fit fit(points, box.center(), size, start);
      const CoverCapsule found =
          fit.at(rough ? improved(fit, 0.03, 1e-3) : improved(fit, 1e-5, 1e-9));
      const double volume = volume_of(found);
      if (!(volume < least)) continue;
      best = found;
      least = volume;
    }
  // A capsule is convex: if it contains the points, it contains everything between them. The margin
  // exceeds rounding by a factor of a million.
  double most = 0;
  const Vector3d along = best.end - best.begin;
  for (const Vector3d& p : points) {
    const double t = along.isZero()
                         ? 0
                         : std::clamp((p - best.begin).dot(along) / along.squaredNorm(), 0.0, 1.0);
    most = std::max(most, (p - best.begin - t * along).norm());
  }
  best.radius = most + 1e-10 * (most + box.center().norm() + size);
  return best;
}

constexpr std::size_t kLayers = 12;

/// Points of each layer between equidistant planes across a direction: corners of triangles in it,
/// and intersections of triangles' sides with planes. The solid's part in a layer lies within the
/// hull of these points: its boundary consists of parts of triangles and of flat cuts, whose
/// borders are in triangles too.
using Layers = std::array<std::vector<Vector3d>, kLayers>;

Layers layers_across(const ClosedMesh& mesh, const Vector3d& along) {
  const auto& vertices = mesh.mesh.vertices;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& t : mesh.mesh.triangles)
    for (const std::uint32_t v : t) {
      low = std::min(low, vertices[v].dot(along));
      high = std::max(high, vertices[v].dot(along));
    }
  const auto plane = [&](std::size_t k) {
    return low + (high - low) * static_cast<double>(k) / kLayers;
  };
  Layers layers;
  for (const auto& t : mesh.mesh.triangles)
    for (int side = 0; side < 3; ++side) {
      Vector3d a = vertices[t[static_cast<std::size_t>(side)]];
      Vector3d b = vertices[t[static_cast<std::size_t>((side + 1) % 3)]];
      if (a.dot(along) > b.dot(along)) std::swap(a, b);
      const double from = a.dot(along), to = b.dot(along);
      for (std::size_t k = 0; k < kLayers; ++k) {
        const double below = plane(k), above = plane(k + 1);
        if (to < below || from > above) continue;
        const auto at = [&](double height) -> Vector3d {
          return to > from ? a + (height - from) / (to - from) * (b - a) : a;
        };
        layers[k].push_back(from >= below ? a : at(below));
        layers[k].push_back(to <= above ? b : at(above));
      }
    }
  for (std::vector<Vector3d>& layer : layers) {  // neighbours share corners
    std::sort(layer.begin(), layer.end(), [](const Vector3d& p, const Vector3d& q) {
      return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
    });
    layer.erase(std::unique(layer.begin(), layer.end()), layer.end());
  }
  return layers;
}

/// The points furthest in some of many directions: a capsule around them is hardly smaller than one
/// around all.
std::vector<Vector3d> outermost(const std::vector<Vector3d>& points) {
  constexpr int kDirections = 80;
  std::vector<std::size_t> best;
  for (int k = 0; k < kDirections && !points.empty(); ++k) {
    const double z = 1 - (2 * k + 1.0) / kDirections,
                 angle = k * std::numbers::phi * 2 * std::numbers::pi;
    const double beside = std::sqrt(1 - z * z);
    const Vector3d along(beside * std::cos(angle), beside * std::sin(angle), z);
    std::size_t most = 0;
    for (std::size_t i = 1; i < points.size(); ++i)
      if (points[i].dot(along) > points[most].dot(along)) most = i;
    best.push_back(most);
  }
  std::sort(best.begin(), best.end());
  best.erase(std::unique(best.begin(), best.end()), best.end());
  std::vector<Vector3d> some;
  for (const std::size_t i : best) some.push_back(points[i]);
  return some;
}

std::vector<Vector3d> joined(const Layers& layers, std::size_t first, std::size_t last) {
  std::vector<Vector3d> points;
  for (std::size_t k = first; k < last; ++k)
    points.insert(points.end(), layers[k].begin(), layers[k].end());
  return points;
}

/// The division of layers with the least sum of volumes.
struct Division {
  std::vector<std::size_t> ends;  ///< the layers after each part
  double volume = std::numeric_limits<double>::infinity();
};

Division divided(const Layers& layers, std::size_t most_parts) {
  Layers thin;
  for (std::size_t k = 0; k < kLayers; ++k) thin[k] = outermost(layers[k]);
  std::array<std::array<double, kLayers + 1>, kLayers> cost = {};  // of layers [i, j)
  tbb::parallel_for(std::size_t{0}, kLayers * kLayers, [&](std::size_t both) {
    const std::size_t i = both / kLayers, j = both % kLayers + 1;
    if (j <= i) return;
    const std::vector<Vector3d> points = outermost(joined(thin, i, j));
    if (!points.empty()) cost[i][j] = volume_of(capsule_around(points, true));
  });
  std::array<Division, kLayers + 1> best;  // of the first layers, by any number of parts so far
  best[0].volume = 0;
  for (std::size_t part = 0; part < most_parts; ++part) {
    std::array<Division, kLayers + 1> next = best;
    for (std::size_t j = 1; j <= kLayers; ++j)
      for (std::size_t i = 0; i < j; ++i)
        if (const double volume = best[i].volume + cost[i][j]; volume < next[j].volume) {
          next[j] = best[i];
          next[j].ends.push_back(j);
          next[j].volume = volume;
        }
    best = next;
  }
  return best[kLayers];
}

}  // namespace

std::vector<CoverCapsule> cover_with_capsules(const ClosedMesh& mesh, std::size_t count,
                                              unsigned threads) {
  if (count < 1 || count > kMostCoverCapsules)
    throw Error(mesh.name + ": " + std::to_string(count) + " capsules; wanted 1 to " +
                std::to_string(kMostCoverCapsules));
  std::vector<bool> used(mesh.mesh.vertices.size());
  for (const auto& t : mesh.mesh.triangles)
    for (const std::uint32_t v : t) used[v] = true;
  std::vector<Vector3d> points;
  for (std::size_t v = 0; v < used.size(); ++v)
    if (used[v]) points.push_back(mesh.mesh.vertices[v]);
  if (points.empty()) throw Error(mesh.name + ": no triangles");
  Layers best_layers;
  Division best;
  thread_arena(threads).execute([&] {
    if (count == 1) return;
    for (const Eigen::Matrix3d& axes :
         {principal_axes(points), Eigen::Matrix3d(Eigen::Matrix3d::Identity())})
      for (int k = 0; k < 3; ++k) {
        Layers layers = layers_across(mesh, axes.col(k));
        Division found = divided(layers, count);
        if (!(found.volume < best.volume)) continue;
        best = std::move(found);
        best_layers = std::move(layers);
      }
  });
  if (best.ends.size() < 2) return {capsule_around(points)};
  std::vector<CoverCapsule> capsules;
  std::size_t first = 0;
  for (const std::size_t last : best.ends) {
    const std::vector<Vector3d> part = joined(best_layers, first, last);
    if (!part.empty()) capsules.push_back(capsule_around(part));
    first = last;
  }
  return capsules;
}

}  // namespace ist
