#pragma once

#include <BulletCollision/CollisionDispatch/btActivatingCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

#include <array>
#include <memory>
#include <vector>

#include "ist_contact.h"

/// What a world's pairs share: settings and scratch. Bullet's dispatcher asks on one thread.
class IstContacts {
 public:
  /// Answers for IstShape with itself, planes, boxes, balls and IstTerrain. Must outlive the
  /// dispatcher. Pairs of IstShape with other shapes do not collide.
  void register_with(btCollisionDispatcher& dispatcher);

  IstSettings settings;
  ist::Workspace workspace;

 private:
  struct CreateFunc : btCollisionAlgorithmCreateFunc {
    IstContacts* contacts = nullptr;
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper* a,
                                                   const btCollisionObjectWrapper* b) override;
  };
  CreateFunc create_;
};

/// One pair of objects whose boxes overlap. Bullet makes and ends it.
class IstCollisionAlgorithm : public btActivatingCollisionAlgorithm {
 public:
  IstCollisionAlgorithm(const btCollisionAlgorithmConstructionInfo& info, IstContacts& contacts);
  ~IstCollisionAlgorithm() override;

  /// Fills the manifolds where the solver is to answer, or moves what is in them
  /// (IstSettings::follow); else does nothing.
  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                        const btDispatcherInfo& info, btManifoldResult* result) override;

  /// Pushes both bodies by the law's force for a step of `step` [s], as of where they are now.
  void push(const btCollisionObject& first, const btCollisionObject& second, double step);

  /// What push() did last, on the object that is IstPair::b; and that object.
  const ist::ContactForce& pushed() const { return state_->pushed; }
  const btCollisionObject* pushed_body() const { return state_->pushed_body; }

  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override;

 private:
  // Bullet's pool of algorithms has places of a fixed size, which nobody checks in a release build.
  struct State {
    std::vector<btPersistentManifold*> manifolds;
    std::array<btVector3, IstSettings::kPatches> normals;  // of all points, in the first's frame
    btTransform b_in_a;                                    // when last asked
    double still = -1;  // [u] until a point has moved by more than this that answer holds
    ist::ContactMemory memory;
    ist::ContactForce pushed;
    const btCollisionObject* pushed_body = nullptr;
  };

  void fill_manifolds(const btCollisionObject* first, const btCollisionObject* second,
                      const IstContact& contact);
  void move_points(const btCollisionObject& first, const btCollisionObject& second);

  IstContacts& contacts_;
  std::unique_ptr<State> state_;
};
