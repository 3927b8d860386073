#include "robots/covers/open_corners.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "robots/covers/triangles.h"

namespace ist {
namespace {

using Eigen::Vector3d;

using Corners = std::array<Vector3d, 3>;
using Polygon = std::vector<Vector3d>;

template <class Points>
bool holds(const CoverSphere& ball, const Points& points) {
  const double within2 = ball.radius * ball.radius;
  return std::all_of(points.begin(), points.end(),
                     [&](const Vector3d& p) { return (p - ball.centre).squaredNorm() <= within2; });
}

class Cutter {
 public:
  /// Cuts triangles within a box.
  Cutter(std::span<const CoverSphere> balls, const Eigen::AlignedBox3d& box) : balls_(balls) {
    for (std::uint32_t i = 0; i < balls.size(); ++i)
      if (box.squaredExteriorDistance(balls[i].centre) <= balls[i].radius * balls[i].radius)
        touching_.push_back(i);
  }

  /// `holder`: tried first, and set to what contains the triangle whole.
  void cut(const Corners& triangle, std::uint32_t& holder, std::vector<OpenCorner>& out) {
    if (holder < balls_.size() && holds(balls_[holder], triangle)) return;
    const Vector3d middle = (triangle[0] + triangle[1] + triangle[2]) / 3;
    double reach2 = 0;
    for (const Vector3d& corner : triangle)
      reach2 = std::max(reach2, (corner - middle).squaredNorm());
    const double reach = std::sqrt(reach2);
    near_.clear();
    for (const std::uint32_t i : touching_) {
      const double d2 = (middle - balls_[i].centre).squaredNorm();
      const double touching = balls_[i].radius + reach;
      if (!(balls_[i].radius > 0) || d2 > touching * touching) continue;
      if (d2 <= balls_[i].radius * balls_[i].radius && holds(balls_[i], triangle)) {
        holder = i;
        return;
      }
      near_.push_back(i);
    }
    if (near_.empty()) {
      for (const Vector3d& corner : triangle) emit(corner, out);
      return;
    }
    for (const std::uint32_t i : near_) {
      piece_.assign(triangle.begin(), triangle.end());
      if (!cut_to_cell(i)) continue;
      for (const Vector3d& corner : piece_)
        if ((corner - balls_[i].centre).squaredNorm() > balls_[i].radius * balls_[i].radius)
          emit(corner, out);
    }
  }

 private:
  /// Clips the piece to the ball's cell; false if nothing is left, or the ball contains it.
  bool cut_to_cell(std::uint32_t i) {
    const CoverSphere& own = balls_[i];
    const double own_power = own.centre.squaredNorm() - own.radius * own.radius;
    for (const std::uint32_t j : near_) {
      if (j == i) continue;
      const CoverSphere& other = balls_[j];
      const Vector3d across = 2 * (other.centre - own.centre);
      const double bound = other.centre.squaredNorm() - other.radius * other.radius - own_power;
      clipped_.clear();
      double before = across.dot(piece_.back()) - bound;
      for (std::size_t k = 0, last = piece_.size() - 1; k < piece_.size(); last = k++) {
        const double here = across.dot(piece_[k]) - bound;
        if ((before > 0) != (here > 0))
          clipped_.push_back(piece_[last] + before / (before - here) * (piece_[k] - piece_[last]));
        if (here <= 0) clipped_.push_back(piece_[k]);
        before = here;
      }
      const bool cut = clipped_.size() != piece_.size();
      piece_.swap(clipped_);
      if (piece_.empty() || (cut && holds(own, piece_))) return false;
    }
    return !holds(own, piece_);
  }

  void emit(const Vector3d& place, std::vector<OpenCorner>& out) const {
    double gap = std::numeric_limits<double>::infinity();
    for (const CoverSphere& ball : balls_)
      gap = std::min(gap, std::sqrt((place - ball.centre).squaredNorm()) - ball.radius);
    if (gap > 0) out.push_back({place, gap});
  }

  const std::span<const CoverSphere> balls_;
  std::vector<std::uint32_t> touching_, near_;  ///< balls that reach to the box, and to a triangle
  Polygon piece_, clipped_;
};

}  // namespace

std::vector<OpenCorner> open_corners(const MeshView& mesh, std::span<const CoverSphere> balls,
                                     std::vector<std::uint32_t>& holders) {
  holders.resize(mesh.triangle_count, UINT32_MAX);
  constexpr std::uint32_t kBlock = 32;  // triangles
  const std::uint32_t blocks = (mesh.triangle_count + kBlock - 1) / kBlock;
  std::vector<std::vector<OpenCorner>> found(blocks);
  tbb::parallel_for(std::uint32_t{0}, blocks, [&](std::uint32_t block) {
    const std::uint32_t end = std::min(mesh.triangle_count, (block + 1) * kBlock);
    Eigen::AlignedBox3d box;
    for (std::uint32_t t = block * kBlock; t < end; ++t)
      for (const Vector3d& corner : triangle_corners(mesh, t)) box.extend(corner);
    Cutter cutter(balls, box);
    for (std::uint32_t t = block * kBlock; t < end; ++t)
      cutter.cut(triangle_corners(mesh, t), holders[t], found[block]);
  });
  std::vector<OpenCorner> out;
  for (const auto& corners : found) out.insert(out.end(), corners.begin(), corners.end());
  return out;
}

}  // namespace ist
