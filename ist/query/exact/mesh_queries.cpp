#include "query/exact/mesh_queries.h"

#include <algorithm>

#include "base/team.h"
#include "query/exact/nearest_points.h"
#include "query/exact/orientation.h"

namespace ist {
namespace {

using exact::Point;

/// A pending node; the nearest is on top.
struct WaitingNode {
  double key;
  int level;
  std::uint32_t number;
};

/// A depth-first stack. Among a node's sixteen children the one with the least key comes first.
class NodeStack {
 public:
  explicit NodeStack(const MeshTree& mesh) noexcept { nodes_[size_++] = {0, mesh.top, 0}; }
  bool empty() const noexcept { return size_ == 0; }
  WaitingNode pop() noexcept { return nodes_[--size_]; }
  /// Pushes the children of a box block whose key is less than `limit`.
  void push(const MeshTree& mesh, const WaitingNode& of, const double (&key)[kWidth],
            double limit) noexcept {
    const std::uint32_t first = size_;
    const std::uint32_t used =
        std::min(kWidth, mesh.level[of.level - 1].count - kWidth * of.number);
    for (std::uint32_t l = 0; l < used; ++l) {
      if (!(key[l] < limit)) continue;
      std::uint32_t place = size_++;
      for (; place > first && nodes_[place - 1].key < key[l]; --place)
        nodes_[place] = nodes_[place - 1];
      nodes_[place] = {key[l], of.level - 1, kWidth * of.number + l};
    }
  }

 private:
  std::uint32_t size_ = 0;
  WaitingNode nodes_[kWidth * kMaxLevels];
};

void corners_of(const MeshTree& mesh, const MeshBlock& block, std::uint32_t t,
                Point (&corners)[3]) noexcept {
  for (int k = 0; k < 3; ++k) corners[k] = mesh.vertex(block.vertex[block.corner[k][t]]);
}

/// A segment from p to q, and the triangles that it may cross.
class Segment {
 public:
  Segment(const Point& p, const Point& q) noexcept : p_(p), q_(q) {
    const double along[3] = {q.x - p.x, q.y - p.y, q.z - p.z};
    for (int k = 0; k < 3; ++k) {
      from_[k] = (&p.x)[k];
      along_[k] = along[k];
      // Along axes without extent, boxes beside the segment are entered beyond its end.
      constexpr double kLeast = 1e-150;
      inverse_[k] = 1 / (std::abs(along[k]) > kLeast ? along[k] : kLeast);
    }
    main_ = std::abs(along[0]) > std::abs(along[1]) ? 0 : 1;
    if (std::abs(along[2]) > std::abs(along[main_])) main_ = 2;
  }

  /// The positions where the segment enters sixteen boxes; HUGE_VAL for those beside it.
  void enter(const BoxBlock& boxes, double (&key)[kWidth]) const noexcept {
    double enter[kWidth], leave[kWidth];
    for (std::uint32_t l = 0; l < kWidth; ++l) enter[l] = 0, leave[l] = 1;
    for (int k = 0; k < 3; ++k)
      for (std::uint32_t l = 0; l < kWidth; ++l) {
        const double low = (boxes.low[k][l] - from_[k]) * inverse_[k];
        const double high = (boxes.high[k][l] - from_[k]) * inverse_[k];
        const double first = std::min(low, high), last = std::max(low, high);
        constexpr double kRounding = 1e-15;
        enter[l] = std::max(enter[l], first - kRounding * std::abs(first));
        leave[l] = std::min(leave[l], last + kRounding * std::abs(last));
      }
    for (std::uint32_t l = 0; l < kWidth; ++l) key[l] = enter[l] <= leave[l] ? enter[l] : HUGE_VAL;
  }

  void hit(const MeshTree& mesh, std::uint32_t number, MeshHit& best) const noexcept {
    const MeshBlock& block = mesh.blocks[number];
    // Vertices relative to the segment, which is the origin, with errors of at most `blur`.
    const int i = (main_ + 1) % 3, j = (main_ + 2) % 3;
    double across[2][kWidth], ahead[kWidth], reach = 0;
    for (std::uint32_t v = 0; v < kWidth; ++v) {
      const double* const x = mesh.vertices + std::size_t{3} * block.vertex[v];
      ahead[v] = (x[main_] - from_[main_]) / along_[main_];
      across[0][v] = (x[i] - from_[i]) - ahead[v] * along_[i];
      across[1][v] = (x[j] - from_[j]) - ahead[v] * along_[j];
      for (int k = 0; k < 3; ++k) reach = std::max(reach, std::abs(x[k]) + std::abs(from_[k]));
    }
    const double blur = 2e-15 * reach;
    for (std::uint32_t t = 0; t < block.triangles; ++t) {
      const std::uint32_t c[3] = {block.corner[0][t], block.corner[1][t], block.corner[2][t]};
      bool beside = false;
      for (const auto& x : across)
        beside |= std::min({x[c[0]], x[c[1]], x[c[2]]}) > blur ||
                  std::max({x[c[0]], x[c[1]], x[c[2]]}) < -blur;
      const auto [first, last] = std::minmax({ahead[c[0]], ahead[c[1]], ahead[c[2]]});
      if (beside || first - 4e-15 > std::min(1.0, best.t) || last < -4e-15) continue;
      Point corners[3];
      corners_of(mesh, block, t, corners);
      if (exact::enters(p_, q_, corners, true, {0, 0, 0}) == 0) continue;
      const Point normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
      const double climbed = dot(normal, corners[0] - p_), climb = dot(normal, q_ - p_);
      // If the edge hardly climbs, the corners are more accurate.
      const double t_plane = climb != 0 && std::abs(climbed) <= 2 * std::abs(climb)
                                 ? climbed / climb
                                 : 0.5 * (first + last);
      const double at = std::clamp(std::clamp(t_plane, first, last), 0.0, 1.0);
      const std::uint32_t triangle = kWidth * number + t;
      if (at < best.t || (at == best.t && triangle < best.triangle)) best = {at, triangle, normal};
    }
  }

 private:
  Point p_, q_;
  double from_[3], along_[3], inverse_[3];
  int main_;  ///< the axis along which it goes furthest
};

}  // namespace

bool is_inside(const MeshOfPair& solid, const Point& p, const Point& aside) noexcept {
  InsideStack stack;
  bool unsure = false;
  return is_inside<true>(SerialTeam(), solid, p, aside, stack, unsure);
}

MeshHit first_hit(const MeshTree& mesh, const Point& p, const Point& q) noexcept {
  const Segment segment(p, q);
  MeshHit best;
  for (NodeStack stack(mesh); !stack.empty();) {
    const WaitingNode node = stack.pop();
    if (node.key > best.t + 4e-15) continue;
    if (node.level == 0) {
      segment.hit(mesh, node.number, best);
      continue;
    }
    double key[kWidth];
    segment.enter(mesh.level[node.level].boxes[node.number], key);
    stack.push(mesh, node, key, std::min(2.0, best.t + 4e-15));
  }
  return best;
}

MeshFoot nearest_on(const MeshTree& mesh, const Point& p, double limit) noexcept {
  // Points that are nearer by rounding alone need no visit: far away all are equally near.
  constexpr double kNearer = 1 - 4e-15;
  MeshFoot best;
  best.squared = limit * limit;
  for (NodeStack stack(mesh); !stack.empty();) {
    const WaitingNode node = stack.pop();
    if (!(node.key < kNearer * best.squared)) continue;
    if (node.level == 0) {
      const MeshBlock& block = mesh.blocks[node.number];
      for (std::uint32_t t = 0; t < block.triangles; ++t) {
        Point corners[3];
        corners_of(mesh, block, t, corners);
        const exact::FlatTriangle flat(corners[0], corners[1], corners[2]);
        const double height = dot(flat.normal, p - corners[0]);
        if (kNearer * (height * height) > best.squared * flat.squared_normal) continue;
        const Point at = nearest_on_triangle(p, flat);
        const double squared = dot(p - at, p - at);
        if (squared < best.squared) best = {squared, at, kWidth * node.number + t, flat.normal};
      }
      continue;
    }
    const BoxBlock& boxes = mesh.level[node.level].boxes[node.number];
    double key[kWidth] = {}, along[kWidth] = {};
    for (int k = 0; k < 3; ++k)
      for (std::uint32_t l = 0; l < kWidth; ++l) {
        const double at = (&p.x)[k];
        const double gap = std::max(0.0, std::max(boxes.low[k][l] - at, at - boxes.high[k][l]));
        key[l] += gap * gap;
        along[l] += boxes.normal[k][l] * at;
      }
    for (std::uint32_t l = 0; l < kWidth; ++l) {
      constexpr double kLength = 1 - 1e-5;  // a lower bound of normals' lengths
      const double slab = kLength * std::max(0.0, std::max(boxes.slab_low[l] - along[l],
                                                           along[l] - boxes.slab_high[l]));
      key[l] = std::max(key[l], slab * slab);
    }
    stack.push(mesh, node, key, kNearer * best.squared);
  }
  return best;
}

}  // namespace ist
