#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <ist/asset_layout.h>
#include <ist/contact_law.h>
#include <ist/pose_eigen.h>
#include <ist/raycast.h>

#include "query/base/relative_pose.h"
#include "query/contact/contact_numbers.h"

namespace ist {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kDirections = 32;
constexpr std::uint64_t kName = std::uint64_t{1} << 63;

/// The cosine and sine of 1.1°: faces at a larger angle to the contact's normal do not belong to
/// it. Spheres that protrude over an edge tilt the normal. With spheres, faces may therefore
/// deviate by 8° from it, but by no more than 1.1° from each other.
constexpr double kFacing = 0.9998, kTurned = 0.02;
/// The cosine and sine of 8°. Faces between the two angles belong to a round surface.
constexpr double kRound = 0.99, kTurnedRound = 0.141;
constexpr double kTurnedAgainst = 1e-3;  // [rad] two faces at a larger angle are not coplanar
/// Faces further than this many depths from the middle of a contact do not belong to it.
constexpr double kNearMiddle = 2;
/// A face is in the plane of the outermost one within this fraction of that distance.
constexpr double kInPlane = 0.05;
/// Within this fraction of the radius of a disc of the contact's area around the middle, a contact
/// is flat or round.
constexpr double kMiddle = 0.25;
/// The largest area of a contact over that of its faces: beyond it a part is not flat.
constexpr double kMostArea = 1.5;
constexpr double kAlike = 5e-3;              // fraction of the polygon's width
constexpr std::size_t kMostPairs = 1 << 14;  // of faces

double cross(double u, double v, double s, double t) { return u * t - v * s; }

}  // namespace

/// The common part of the faces: its area, and its outermost corner in each direction.
struct SupportPolygon::Hull {
  struct Polygon {
    std::array<Corner, 8> corner;
    std::size_t count = 0;
    void add(const Corner& x) {
      if (count < corner.size()) corner[count++] = x;
    }
  };

  Hull() {
    // Directions lie between the axes, since a box has two outermost corners along an axis.
    double u = kHalfCos, v = kHalfSin;
    for (int k = 0; k < kDirections; ++k) {
      direction[k][0] = u;
      direction[k][1] = v;
      const double next = u * kCos - v * kSin;
      v = u * kSin + v * kCos;
      u = next;
      most[k] = -std::numeric_limits<double>::infinity();
    }
  }

  /// The part with `depth` ≥ 0, a linear function.
  template <class Depth>
  static Polygon clipped(const Polygon& from, const Depth& depth) {
    Polygon to;
    for (std::size_t i = 0; i < from.count; ++i) {
      const Corner &x = from.corner[i], &y = from.corner[(i + 1) % from.count];
      const double at_x = depth(x), at_y = depth(y);
      if (at_x >= 0) to.add(x);
      if ((at_x >= 0) == (at_y >= 0)) continue;
      const double t = at_x / (at_x - at_y);
      to.add({x.u + t * (y.u - x.u), x.v + t * (y.v - x.v), 0});
    }
    return to;
  }

  void add(const Polygon& part) {
    for (std::size_t i = 0; i < part.count; ++i) {
      const Corner &x = part.corner[i], &y = part.corner[(i + 1) % part.count];
      const double half = 0.5 * cross(x.u, x.v, y.u, y.v);
      area += half;
      moment[0] += half * (x.u + y.u) / 3;
      moment[1] += half * (x.v + y.v) / 3;
      for (int k = 0; k < kDirections; ++k) {
        const double along = direction[k][0] * x.u + direction[k][1] * x.v;
        if (!(along > most[k])) continue;
        most[k] = along;
        outermost[k] = x;
      }
    }
  }

  static constexpr double kCos = 0.98078528040323043, kSin = 0.19509032201612825;  // of π/16
  static constexpr double kHalfCos = 0.99518472667219693, kHalfSin = 0.098017140329560604;  // π/32
  double direction[kDirections][2], most[kDirections];
  Corner outermost[kDirections];
  double area = 0, moment[2] = {0, 0};
};

SupportPolygon::SupportPolygon(const Penetration& whole, const Vector3d& origin_b,
                               const Matrix3d& axes, double reach, double blur) noexcept
    : whole_(whole), origin_b_(origin_b), reach_(reach), blurred_(blur > 0) {
  const PatchAxis axis =
      PatchAxis::of(whole.volume, plain(whole.centroid), plain(whole.force), plain(whole.torque),
                    plain(origin_b), std::numeric_limits<double>::infinity());
  area_ = axis.area;
  near_ = kNearMiddle * axis.depth + blur;
  torsion_ = axis.torsion;
  middle_ = vector(axis.point);
  normal_ = vector(axis.normal);
  int across = 0;
  (axes.transpose() * normal_).cwiseAbs().minCoeff(&across);
  axis_[0] = axes.col(across) - normal_ * normal_.dot(axes.col(across));
  if (area_ > 0) axis_[0].normalize();
  axis_[1] = normal_.cross(axis_[0]);
}

SupportPolygon::Corner SupportPolygon::corner(const Vector3d& x) const {
  const Vector3d from = x - middle_;
  return {axis_[0].dot(from), axis_[1].dot(from), normal_.dot(from)};
}

SupportPolygon::Plane SupportPolygon::plane_of(const Face& face) {
  const double u1 = face[1].u - face[0].u, v1 = face[1].v - face[0].v, z1 = face[1].z - face[0].z;
  const double u2 = face[2].u - face[0].u, v2 = face[2].v - face[0].v, z2 = face[2].z - face[0].z;
  const double two = cross(u1, v1, u2, v2);
  Plane plane;
  plane.slope[0] = (z1 * v2 - z2 * v1) / two;
  plane.slope[1] = (z2 * u1 - z1 * u2) / two;
  plane.height = face[0].z - (face[0].u * plane.slope[0] + face[0].v * plane.slope[1]);
  return plane;
}

void SupportPolygon::add_triangle(bool of_b, const Vector3d& p, const Vector3d& q,
                                  const Vector3d& r) noexcept {
  const Vector3d normal = (q - p).cross(r - p);
  const double facing = of_b ? -normal_.dot(normal) : normal_.dot(normal);
  if (!(area_ > 0) || !flat_ || !(facing > 0)) return;
  const double square = facing * facing / normal.squaredNorm();
  if (!(square > kRound * kRound)) return;
  const double radius = std::sqrt(std::max((q - p).squaredNorm(), (r - p).squaredNorm()));
  if ((p - middle_).squaredNorm() > (reach_ + radius) * (reach_ + radius)) return;
  const Face face = {corner(p), corner(of_b ? r : q), corner(of_b ? q : r)};
  Side& side = sides_[of_b];
  const Plane plane = plane_of(face);
  const bool first = side.count == 0 && !side.has_middle;
  if (blurred_ ? !first && !plane.is_along(side.plane, kTurned) : !(square > kFacing * kFacing)) {
    const auto is_here = [&](const Corner& x) {
      return std::abs(x.z - (blurred_ ? side.plane.at(x) : 0)) <= near_;
    };
    flat_ = is_at_rim(face) || std::none_of(face.begin(), face.end(), is_here);
    return;
  }
  if (!(std::abs((p - middle_).dot(normal)) <= near_ * facing)) return;
  const bool at_rim = is_at_rim(face);
  if (first) side.plane = plane;
  const bool fits = plane.is_along(side.plane, kTurnedAgainst) || is_near(face, side.plane);
  if (!at_rim && !side.has_middle) {
    side.plane = plane;
    side.has_middle = true;
    if (!fits) side.count = 0;
  } else if (!fits) {
    flat_ = at_rim;
    return;
  }
  flat_ = side.count < kFaces;
  if (flat_) side.faces[side.count++] = face;
}

void SupportPolygon::add_plane(bool of_b, const Vector3d& normal, const Vector3d& point) noexcept {
  const double facing = of_b ? -normal_.dot(normal) : normal_.dot(normal);
  const double height = normal.dot(point - middle_) / (of_b ? -facing : facing);
  if (!(area_ > 0) || !(facing > (blurred_ ? kRound : kFacing)) || !(std::abs(height) <= near_))
    return;
  const double sign = of_b ? 1 / facing : -1 / facing;
  sides_[of_b].endless = true;
  sides_[of_b].plane = {height, {sign * normal.dot(axis_[0]), sign * normal.dot(axis_[1])}};
}

bool SupportPolygon::add(bool of_b, const PlacedSolid& solid) noexcept {
  if (const auto* const tree = std::get_if<PlacedAsset>(&solid.placed)) {
    if (!tree->asset.has_mesh()) return false;
    if (area_ > 0) add_mesh(of_b, *tree);
    return true;
  }
  const PlacedShape& placed = std::get<PlacedShape>(solid.placed);
  const Eigen::Isometry3d pose = to_isometry(placed.pose);
  if (const auto* const half = std::get_if<HalfSpaceShape>(&placed.shape)) {
    const double length = half->normal.norm();
    const Vector3d normal = half->normal / length;
    add_plane(of_b, pose.linear() * normal, pose * (placed.scale * half->offset / length * normal));
    return true;
  }
  if (const auto* const box = std::get_if<BoxShape>(&placed.shape)) {
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {-1.0, 1.0}) {
        const auto at = [&](double s, double t) -> Vector3d {
          Vector3d x;
          x[axis] = sign;
          x[(axis + 1) % 3] = s;
          x[(axis + 2) % 3] = sign * t;
          return pose * (placed.scale * x.cwiseProduct(box->half_extents));
        };
        add_triangle(of_b, at(-1, -1), at(1, -1), at(1, 1));
        add_triangle(of_b, at(-1, -1), at(1, 1), at(-1, 1));
      }
    return true;
  }
  return false;
}

void SupportPolygon::add_mesh(bool of_b, const PlacedAsset& solid) noexcept {
  const AssetHeader& asset = solid.asset.header();
  const MeshHeader& mesh = *at<MeshHeader>(asset, asset.mesh);
  const double* const vertices = at<double>(asset, mesh.vertices);
  const MeshBlock* const blocks = at<MeshBlock>(asset, mesh.level[0].blocks);
  const Eigen::Isometry3d pose = to_isometry(solid.pose);
  const double unit = solid.scale * std::ldexp(1.0, asset.exponent);
  const Matrix3d turn = unit * pose.linear();
  const Vector3d shift = pose * (solid.scale * Vector3d(asset.centre));
  // The normal and the middle in the mesh's frame.
  const Vector3d normal = turn.transpose() * normal_ / unit;
  const Vector3d middle = turn.transpose() * (middle_ - shift) / (unit * unit);
  const double near = near_ / unit;
  const double turned = 1.05 * (blurred_ ? kTurnedRound : kTurned);
  struct Waiting {
    std::uint32_t level, block;
  };
  const auto visit = [&](double reach) {
    Waiting waiting[kWidth * kMaxLevels];
    std::size_t count = 0;
    waiting[count++] = {mesh.level_count - 1, 0};
    while (count > 0 && flat_) {
      const auto [level, block] = waiting[--count];
      if (level == 0) {
        const MeshBlock& from = blocks[block];
        Vector3d x[kWidth];
        for (std::uint32_t v = 0; v < from.vertices; ++v)
          x[v] = turn * Vector3d(vertices + 3 * std::size_t{from.vertex[v]}) + shift;
        for (std::uint32_t t = 0; t < from.triangles; ++t)
          add_triangle(of_b, x[from.corner[0][t]], x[from.corner[1][t]], x[from.corner[2][t]]);
        continue;
      }
      const BoxBlock& boxes = at<BoxBlock>(asset, mesh.level[level].blocks)[block];
      const std::uint32_t below = mesh.level[level - 1].count;
      for (std::uint32_t lane = 0; lane < kWidth && kWidth * block + lane < below; ++lane) {
        // The sum of a vector's absolute coordinates bounds its length.
        double along = 0, half_along = 0, furthest = 0, apart = 0;
        for (int k = 0; k < 3; ++k) {
          const double low = boxes.low[k][lane], high = boxes.high[k][lane];
          const double from = 0.5 * (high + low) - middle[k], half = 0.5 * (high - low);
          along += normal[k] * from;
          half_along += std::abs(normal[k]) * half;
          furthest += std::abs(from) + half;
          apart = std::max(apart, std::abs(from) - half);
        }
        if (apart > reach || std::abs(along) - half_along > near + turned * furthest) continue;
        waiting[count++] = {level - 1, kWidth * block + lane};
      }
    }
  };
  // The middle suffices to reject most round surfaces, and shows the plane of flat ones.
  visit(near);
  sides_[of_b].count = 0;
  visit(reach_ / unit);
}

bool SupportPolygon::Plane::is_along(const Plane& other, double most) const {
  return std::max(std::abs(slope[0] - other.slope[0]), std::abs(slope[1] - other.slope[1])) < most;
}

bool SupportPolygon::is_at_rim(const Face& face) const {
  if (blurred_) return false;  // the middle is not known well enough
  bool inside = true;
  double nearest = std::numeric_limits<double>::infinity();  // to the middle, squared
  for (int k = 0; k < 3; ++k) {
    const Corner &from = face[k], &to = face[(k + 1) % 3];
    const double u = to.u - from.u, v = to.v - from.v;
    const double t = std::clamp(-(from.u * u + from.v * v) / (u * u + v * v), 0.0, 1.0);
    const double x = from.u + t * u, y = from.v + t * v;
    nearest = std::min(nearest, x * x + y * y);
    inside = inside && cross(from.u, from.v, u, v) >= 0;
  }
  return !inside && std::numbers::pi * nearest > kMiddle * kMiddle * area_;
}

/// The plane of the face that is outermost under the middle.
bool SupportPolygon::choose_plane(bool of_b, Plane& plane) const {
  const Side& side = sides_[of_b];
  plane = side.plane;
  for (std::size_t i = 0; i < side.count && !side.endless; ++i) {
    const Plane found = plane_of(side.faces[i]);
    if (found.is_along(side.plane, kTurnedAgainst) &&
        (of_b ? found.height < plane.height : found.height > plane.height))
      plane = found;
  }
  return side.endless || side.count > 0;
}

bool SupportPolygon::is_near(const Face& face, const Plane& plane) const {
  return std::all_of(face.begin(), face.end(), [&](const Corner& x) {
    return std::abs(x.z - plane.at(x)) <= kInPlane * near_;
  });
}

std::optional<std::size_t> SupportPolygon::corners(std::span<ContactPatch> patches) const noexcept {
  Plane plane[2];
  if (!flat_ || patches.size() < 3 || !choose_plane(false, plane[0]) ||
      !choose_plane(true, plane[1]) || (sides_[0].endless && sides_[1].endless) ||
      (blurred_ && !plane[0].is_along(plane[1], kTurned)))
    return std::nullopt;
  const auto depth = [&](const Corner& x) { return plane[0].at(x) - plane[1].at(x); };
  const bool first = sides_[0].endless;
  const Side &one = sides_[first], &other = sides_[!first];
  if (one.count * other.count > kMostPairs) return std::nullopt;
  Hull overlapping, facing;  // the part that overlaps, and all that face each other
  for (std::size_t i = 0; i < one.count; ++i) {
    if (!is_near(one.faces[i], plane[first])) continue;
    Hull::Polygon own;
    for (const Corner& x : one.faces[i]) own.add(x);
    for (std::size_t j = 0; j < (other.endless ? 1 : other.count); ++j) {
      Hull::Polygon shared = own;
      if (!other.endless && !is_near(other.faces[j], plane[!first])) continue;
      for (int k = 0; k < 3 && shared.count > 0 && !other.endless; ++k) {
        const Corner &from = other.faces[j][k], &to = other.faces[j][(k + 1) % 3];
        shared = Hull::clipped(shared, [&](const Corner& x) {
          return cross(to.u - from.u, to.v - from.v, x.u - from.u, x.v - from.v);
        });
      }
      facing.add(shared);
      overlapping.add(Hull::clipped(shared, depth));
    }
  }
  if (!(area_ < kMostArea * facing.area)) return std::nullopt;
  const bool apart = blurred_ && !(overlapping.area > 0);
  const Hull& hull = apart ? facing : overlapping;
  if (!blurred_ && !(area_ < kMostArea * hull.area && hull.area < kMostArea * area_))
    return std::nullopt;
  // The point and direction of the force.
  const double mean[2] = {0.5 * (plane[0].slope[0] + plane[1].slope[0]),
                          0.5 * (plane[0].slope[1] + plane[1].slope[1])};
  const double middle[2] = {blurred_ ? hull.moment[0] / hull.area : 0,
                            blurred_ ? hull.moment[1] / hull.area : 0};
  const double area = blurred_ ? hull.area : area_;
  const Vector3d normal =
      blurred_ ? Vector3d(normal_ - mean[0] * axis_[0] - mean[1] * axis_[1]).normalized() : normal_;

  // Merges corners that hardly differ, which would come and go.
  double alike = 0;
  for (int k = 0; k < kDirections / 2; ++k)
    alike = std::max(alike, kAlike * (hull.most[k] + hull.most[k + kDirections / 2]));
  Corner ring[kDirections];
  int name[kDirections], count = 0;
  for (int stride = 1; stride == 1 || count > static_cast<int>(patches.size()); stride *= 2) {
    count = 0;
    const auto same = [&](const Corner& x, const Corner& y) {
      return std::abs(x.u - y.u) <= alike && std::abs(x.v - y.v) <= alike;
    };
    for (int k = 0; k < kDirections; k += stride) {
      const Corner& x = hull.outermost[k];
      if (count > 0 && (same(ring[count - 1], x) || same(ring[0], x))) continue;
      ring[count] = x;
      name[count++] = k;
    }
  }
  if (count < 3) return std::nullopt;
  for (int i = 0; i < count; ++i) ring[i].u -= middle[0], ring[i].v -= middle[1];

  // Mean value coordinates of the middle (Floater 2003): positive, and Σ weight · corner is 0.
  double half[kDirections], length[kDirections], weight[kDirections], sum = 0;
  for (int i = 0; i < count; ++i)
    length[i] = std::sqrt(ring[i].u * ring[i].u + ring[i].v * ring[i].v);
  for (int i = 0; i < count; ++i) {
    const int j = (i + 1) % count;
    const double sine = cross(ring[i].u, ring[i].v, ring[j].u, ring[j].v);
    const double both = length[i] * length[j];
    if (!(sine > 1e-6 * both)) return std::nullopt;  // the middle is on the border, or outside
    half[i] = sine / (both + ring[i].u * ring[j].u + ring[i].v * ring[j].v);  // tan(angle / 2)
  }
  double volume = 0;
  for (int i = 0; i < count; ++i) {
    weight[i] = (half[(i + count - 1) % count] + half[i]) / length[i];
    sum += weight[i];
  }
  for (int i = 0; i < count; ++i) {
    ring[i].u += middle[0];
    ring[i].v += middle[1];
    weight[i] *= area / sum;
    volume += weight[i] * std::max(0.0, depth(ring[i]));
  }
  if (!apart && !(volume > 0)) return std::nullopt;
  for (int i = 0; i < count; ++i) {
    const double z = 0.5 * (plane[0].at(ring[i]) + plane[1].at(ring[i]));
    ContactPatch& patch = patches[static_cast<std::size_t>(i)] = {};
    patch.id = kName | static_cast<std::uint64_t>(name[i]);
    patch.centroid = patch.point =
        middle_ + ring[i].u * axis_[0] + ring[i].v * axis_[1] + z * normal_;
    patch.normal = normal;
    patch.area = weight[i];
    patch.depth = depth(ring[i]);
    if (apart) continue;
    patch.depth = std::max(0.0, patch.depth) * (blurred_ ? 1 : whole_.volume / volume);
    patch.volume = patch.area * patch.depth;
    patch.force = patch.area * normal;
    patch.torsion = blurred_ ? 0 : torsion_ * (patch.area / area_);
    patch.torque = (patch.point - origin_b_).cross(patch.force) + patch.torsion * normal;
  }
  return static_cast<std::size_t>(count);
}

ContactPatches contact_points(const PlacedSolid& a, const PlacedSolid& b,
                              const ContactSettings& settings, Workspace& workspace,
                              std::span<ContactPatch> patches) noexcept {
  ContactPatches found = contact_patches(a, b, settings, workspace, patches);
  if (found.count == 0 || found.penetration.status != QueryStatus::ok) return found;
  const auto* const tree_a = std::get_if<PlacedAsset>(&a.placed);
  const auto* const tree_b = std::get_if<PlacedAsset>(&b.placed);
  const auto radius = [](const PlacedAsset* tree) {
    return tree != nullptr ? tree->scale * tree->asset.header().ball_radius
                           : std::numeric_limits<double>::infinity();
  };
  const auto blur = [](const PlacedAsset* tree) {
    return tree != nullptr ? tree->scale * tree->asset.protrusion() : 0;
  };
  const bool by_b = radius(tree_b) <= radius(tree_a);
  const Pose& pose_b = std::visit([](const auto& at) -> const Pose& { return at.pose; }, b.placed);
  SupportPolygon polygon(found.penetration, Vector3d(pose_b.t),
                         to_isometry((by_b ? tree_b : tree_a)->pose).linear(),
                         2 * std::min(radius(tree_a), radius(tree_b)),
                         settings.measure == Measure::exact ? 0 : blur(tree_a) + blur(tree_b));
  // Tests the side with fewer triangles first: in most contacts it is not flat.
  const auto triangles = [](const PlacedAsset* tree) {
    return tree != nullptr ? tree->asset.mesh_triangles() : 0;
  };
  const bool b_first = triangles(tree_b) < triangles(tree_a);
  for (const bool of_b : {b_first, !b_first})
    if (!polygon.add(of_b, of_b ? b : a) || !polygon.has_faces(of_b)) return found;
  found.count = polygon.corners(patches).value_or(found.count);
  if (found.count > 0 && !(patches[0].force.squaredNorm() > 0)) found.count = 0;  // apart
  return found;
}

}  // namespace ist
