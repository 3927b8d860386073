#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include <ist/api.h>
#include <ist/query.h>

// Flat contacts by the corners of their support polygon, for engines that solve contact points.

namespace IST_API ist {

/// A contact of two flat faces as points at the corners of the hull of what the faces share.
///
/// The patches of contact_patches() lie within their parts of a face. A body at the edge of a table
/// then tips before its centre is over the edge, since no point there can push. The corners span
/// all forces and torques that the face can transmit. By Measure::exact they sum to the contact's
/// volume, force and torque. By spheres they sum to those of the overlap between the two planes,
/// which spheres blur.
///
/// Give it the whole contact, then the faces of both sides near it, then ask for the corners.
/// Without allocation, lock or exception; a polygon belongs to one thread.
class SupportPolygon {
 public:
  static constexpr std::size_t kFaces = 256;  ///< of a side

  /// `origin_b`: [u] of B's pose, world. `axes`: columns are those of the body on which the corners
  /// keep their names, world. `reach`: [u] no point of the contact is further from its centroid.
  /// `blur`: [u] how far the spheres of both stick out (TreeView::protrusion() times the scale); 0:
  /// the contact is by Measure::exact.
  SupportPolygon(const Penetration& whole, const Eigen::Vector3d& origin_b,
                 const Eigen::Matrix3d& axes, double reach, double blur) noexcept;

  /// The faces of an asset that keeps a mesh, of a half-space or of a box. False for others.
  bool add(bool of_b, const PlacedSolid& solid) noexcept;
  /// [u] World, anticlockwise from outside. What does not face the contact is left out.
  void add_triangle(bool of_b, const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                    const Eigen::Vector3d& r) noexcept;
  /// A face without end. `normal`: unit, outward.
  void add_plane(bool of_b, const Eigen::Vector3d& normal, const Eigen::Vector3d& point) noexcept;

  /// Writes the corners, those of the true hull if they fit and of as many directions as fit if
  /// not. Returns how many, or nothing if the contact is not flat or if there is no room for three:
  /// then use the patches. Where the faces are apart, and spheres alone reach from one to the
  /// other, the depths are negative, the gaps, and no corner has a volume or a force. Ids are those
  /// of directions in `axes`, with the highest bit set: patches have others.
  std::optional<std::size_t> corners(std::span<ContactPatch> patches) const noexcept;

 private:
  struct Corner {
    double u, v, z;  // [u] from the middle along the polygon's axes and the normal
  };
  using Face = std::array<Corner, 3>;
  /// Of the plane of one side's faces: z = height + u · slope[0] + v · slope[1].
  struct Plane {
    double height = 0, slope[2] = {0, 0};
    double at(const Corner& x) const { return height + x.u * slope[0] + x.v * slope[1]; }
  };
  struct Side {
    std::array<Face, kFaces> faces;
    std::size_t count = 0;
    bool endless = false;
    Plane plane;  // of an endless one, or of the first face
  };
  struct Hull;

  Corner corner(const Eigen::Vector3d& x) const;
  static Plane plane_of(const Face& face);
  bool choose_plane(bool of_b, Plane& plane) const;
  bool is_near(const Face& face, const Plane& plane) const;
  void add_mesh(bool of_b, const PlacedTree& solid) noexcept;

  Penetration whole_;
  Eigen::Vector3d origin_b_, middle_, normal_, axis_[2];
  double area_ = 0, twist_ = 0, reach_ = 0, near_ = 0;
  bool blurred_ = false;
  bool flat_ = true;  // as far as is known
  std::array<Side, 2> sides_;
};

/// contact_patches() for engines that solve contact points: the corners of the support polygon if
/// the contact is flat (SupportPolygon), else the patches as they are. The whole contact stays that
/// of contact_patches().
ContactPatches contact_points(const PlacedSolid& a, const PlacedSolid& b,
                              const ContactSettings& settings, Workspace& workspace,
                              std::span<ContactPatch> patches) noexcept;

}  // namespace ist
