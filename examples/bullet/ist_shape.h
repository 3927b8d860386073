#pragma once

#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <ist/field.h>
#include <ist/tree_view.h>

#include <Eigen/Geometry>
#include <vector>

// What Bullet knows of an ist asset: a shape of a type of its own, which no algorithm of Bullet's
// takes for a triangle mesh. register_ist_algorithm() says who answers for it.

/// Bullet's body frame of a baked solid: at its centre of mass, along principal axes. Those of the
/// asset's frame, where they are.
struct IstBodyFrame {
  Eigen::Isometry3d in_mesh;     ///< body's frame to mesh's
  Eigen::Vector3d unit_inertia;  ///< [u²] about the body's axes, of a mass of 1
};
IstBodyFrame body_frame(const ist::TreeView& tree);

/// A baked solid. The asset's bytes must outlive it.
///
/// Bullet turns bodies about their own origin and wants principal axes there: the body's transform
/// is that of body_frame(), not the mesh's.
class IstShape : public btConcaveShape {
 public:
  static constexpr int kType = CUSTOM_CONCAVE_SHAPE_TYPE;

  explicit IstShape(const ist::TreeView& tree);

  const ist::TreeView& tree() const { return tree_; }
  const btTransform& mesh_in_body() const { return mesh_in_body_; }
  double reach() const { return reach_; }  ///< [u] no point is further from the body's origin

  void getAabb(const btTransform& t, btVector3& lower, btVector3& upper) const override;
  void calculateLocalInertia(btScalar mass, btVector3& inertia) const override;
  const char* getName() const override { return "IstShape"; }
  void setMargin(btScalar) override {}  // a volume needs no skin
  btScalar getMargin() const override { return 0; }

  /// Sizes belong to the bake: only 1 is taken.
  void setLocalScaling(const btVector3& scaling) override;
  const btVector3& getLocalScaling() const override { return one_; }

  /// Rays and Bullet's own shapes see no triangles: ask the asset.
  void processAllTriangles(btTriangleCallback*, const btVector3&, const btVector3&) const override {
  }

 private:
  ist::TreeView tree_;
  btTransform mesh_in_body_;
  double reach_;
  btVector3 lower_, upper_;  // in the body's frame
  btVector3 unit_inertia_;   // [u²] about the body's axes, of a mass of 1
  btVector3 one_{1, 1, 1};
};

/// Terrain that both Bullet's shapes and ist's trees stand on: the same heights, the same cut of
/// each cell into two triangles. The heights are the caller's.
class IstTerrain : public btHeightfieldTerrainShape {
 public:
  /// `field` as ist::HeightField says, with the lowest and highest heights set.
  explicit IstTerrain(const ist::HeightField& field);

  const ist::HeightField& field() const { return field_; }
  /// The field's origin, its first column and row at height 0, in the frame of Bullet's shape,
  /// which is centred.
  btVector3 field_origin() const;

 private:
  ist::HeightField field_;
};
