#pragma once

#include <ist/query.h>
#include <dart/collision/CollisionDetector.hpp>

#include <memory>
#include <string>
#include <vector>

namespace ist_dart {

/// DART's collision detector on ist: IstShapes meet each other and DART's plane, box, sphere,
/// capsule and cylinder. Two shapes of which neither is an IstShape do not meet; the first such
/// pair is warned of.
///
/// Registered as "ist": dart::collision::CollisionDetector::getFactory()->create("ist").
///
/// One thread at a time, as it keeps the memory of its queries.
class IstCollisionDetector final : public dart::collision::CollisionDetector {
 public:
  using CollisionGroup = dart::collision::CollisionGroup;
  using CollisionObject = dart::collision::CollisionObject;
  using CollisionOption = dart::collision::CollisionOption;
  using CollisionResult = dart::collision::CollisionResult;
  using DistanceOption = dart::collision::DistanceOption;
  using DistanceResult = dart::collision::DistanceResult;
  using CollisionDetector::createCollisionGroup;

  static std::shared_ptr<IstCollisionDetector> create();
  static const std::string& getStaticType();
  const std::string& getType() const override { return getStaticType(); }
  std::shared_ptr<CollisionDetector> cloneWithoutCollisionObjects() const override;
  std::unique_ptr<CollisionGroup> createCollisionGroup() override;

  /// A contact a patch of inner spheres, both ways between two IstShapes.
  ///
  /// `point`: the centroid of its overlap.
  /// `normal`: pushes object 1, as DART has it; zero where one is wholly inside the other, which
  /// DART's solver passes over.
  /// `penetrationDepth`: the patch's volume over its area: half the depth of a light contact, flat
  /// or round; more than any way out where whole spheres are inside.
  bool collide(CollisionGroup* group, const CollisionOption& option = CollisionOption(false, 1u),
               CollisionResult* result = nullptr) override;
  bool collide(CollisionGroup* group1, CollisionGroup* group2,
               const CollisionOption& option = CollisionOption(false, 1u),
               CollisionResult* result = nullptr) override;

  /// [m] between the inner spheres, so no less than the solids'; never negative: 0 once they
  /// overlap, with both nearest points at the overlap's centroid.
  double distance(CollisionGroup* group, const DistanceOption& option = DistanceOption(),
                  DistanceResult* result = nullptr) override;
  double distance(CollisionGroup* group1, CollisionGroup* group2,
                  const DistanceOption& option = DistanceOption(),
                  DistanceResult* result = nullptr) override;

  // raycast() is the base's, which warns that it is not supported and returns false.

  /// What contacts cannot carry: volume and wrench of two frames where they are now, without a
  /// filter. Gradients are with respect to B if that is an IstShape, else to A; all is zero where
  /// neither is.
  ist::Penetration penetration(const dart::dynamics::ShapeFrame& a,
                               const dart::dynamics::ShapeFrame& b);

  /// Contacts of a pair at most, 1 to 64; 8 unless said otherwise. DART's solver costs the cube of
  /// the contacts of bodies that touch.
  void set_max_patches(std::size_t count);
  std::size_t max_patches() const { return patches_.size(); }

 protected:
  std::unique_ptr<CollisionObject> createCollisionObject(
      const dart::dynamics::ShapeFrame* frame) override;
  void refreshCollisionObject(CollisionObject* object) override;

 private:
  IstCollisionDetector();
  bool owns(const CollisionGroup& group, const char* what) const;
  void warn_of_fields(const CollisionObject& a, const CollisionObject& b);
  bool collide_pair(CollisionObject* a, CollisionObject* b, const CollisionOption& option,
                    CollisionResult* result);
  void measure_pair(const CollisionObject& a, const CollisionObject& b,
                    const DistanceOption& option, DistanceResult& nearest);

  ist::Workspace scratch_;
  std::vector<ist::ContactPatch> patches_;  // as many as a pair may have
  bool warned_of_fields_ = false;
  static Registrar<IstCollisionDetector> registrar_;
};

}  // namespace ist_dart
