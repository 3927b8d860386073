#pragma once

#include <BulletCollision/CollisionDispatch/btActivatingCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletDynamics/Dynamics/btActionInterface.h>
#include <BulletDynamics/Dynamics/btDynamicsWorld.h>

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include <ist/bullet/shape.h>
#include <ist/contact_law.h>
#include <ist/query.h>

// Narrow phase and contact manifolds of assets in Bullet: docs/engines.md. Link ist::bullet with
// Bullet in single precision, ist::bullet-float64 with Bullet in double precision
// (BT_USE_DOUBLE_PRECISION).

namespace ist::bullet {

/// Settings of contact queries and of the contact response.
struct Settings {
  static constexpr std::size_t kPatches = ContactMemory::kPatches;

  enum class Response {
    solver,  ///< patches are springs among the contact points of Bullet's solver
    wrench,  ///< push_in_every_tick() applies the force of `law`, Bullet sees no contact
  };
  Response response = Response::solver;
  std::size_t patches = 8;  ///< [1, kPatches] per contact
  /// Matched spheres replace Measure::exact if an asset has no mesh (AssetView::has_mesh).
  ContactSettings query{.measure = Measure::exact};

  /// law.stiffness [force/u³] is the pressure over depth, for both responses. The solver steps the
  /// springs implicitly, so any stiffness is stable; it uses nothing else of the law. For the
  /// wrench the step limits the stiffness. With law.area every wrench is one patch. Friction uses
  /// Bullet's coefficients.
  ///
  /// Stiffness 0: that of the two shapes (Shape::stiffness, two in series), or else by `depth`.
  ContactLaw law;
  /// Used where no stiffness is set: the depth at which the lighter body rests under its weight on
  /// a face of the smaller asset's size. It is a share of that size, the cube root of the volume.
  /// Beyond this depth the pressure grows with the square of the depth: at ten times the depth a
  /// contact bears a hundred times the weight. A body without gravity is held as stiffly as a step
  /// allows.
  ///
  /// Matched spheres blur flat faces. With a larger depth bodies rest nearer to their true height;
  /// a smaller depth lets higher stacks stand.
  double depth = 0.001;
  /// [u] How far behind the front of its triangles a triangle mesh is solid. 0: the asset's size,
  /// as above. A body that is deeper is behind the mesh and free.
  double thickness = 0;
  /// Damping of a contact over critical damping; solver only. At 1 a body without restitution
  /// rebounds with less than a seventh of its speed, e⁻².
  double damping = 1;
  /// [u/s] Solver only: springs part two bodies no faster than this, or than e^(−2 damping) of the
  /// speed at which they closed, however deep they are when they are first seen in each other.
  /// Their dampers grow instead. Bodies that part faster by themselves, as with restitution, are
  /// not held back. 0: three times the speed of a fall by the resting depth (`depth`, or that of a
  /// softer spring).
  double push_out = 0;
  /// Solver only: two objects are queried again once a point of one has moved relative to the other
  /// by more than this share of the contact's mean depth, or of the depth at which the lighter body
  /// rests if that is more, and in any case by more than the latter. Flat contacts
  /// (SupportPolygon): by a tenth of this share of the resting depth. Until then their patches move
  /// along: the motion changes their depths, and their areas stay. A new contact may be found late
  /// by this motion. 0: queried in every step.
  double follow = 0.2;
};

/// A contact of two objects: forces and normals push the second.
struct Contact {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< [u] reference point of torques, world
  Penetration whole;                                 ///< the contact as one
  std::size_t count = 0;
  std::array<ContactPatch, Settings::kPatches> patches;
  bool flat = false;  ///< the patches are the corners of a SupportPolygon
  /// One solid is wholly inside the other: no force of the volume leads out. The one patch is
  /// the exit instead: moving by `depth` along `normal` parts them, or brings the smaller solid
  /// across the nearest face of the other; `area` is a face of the smaller asset's size.
  bool inside = false;
  /// [u] Of separate objects: they stay apart while no point moves by more than this.
  double clearance = 0;
};

/// How far two bodies get in a motion.
struct Passage {
  double share = 1;      ///< [0, 1] of the motion, until they meet, or in contact are too deep
  bool touched = false;  ///< they were in contact as it began
};

/// Computes the contact of two objects at their current transforms, by Settings::patches and query.
/// False if neither is a Shape, or if a shape is not supported; compounds are not taken apart.
bool find_contact(const btCollisionObject& first, const btCollisionObject& second,
                  const Settings& settings, Contact& contact);

/// Narrow phase for the pairs of a dispatcher in which one object is a Shape. Each thread has its
/// own scratch memory, so btCollisionDispatcherMt may run queries on many threads.
///
/// Added to the world as an action (btDynamicsWorld::addAction), it stops fast bodies where they
/// meet.
class Contacts : public btActionInterface {
 public:
  Contacts() = default;
  Contacts(const Contacts&) = delete;
  Contacts& operator=(const Contacts&) = delete;
  ~Contacts() override;

  /// register_with() the world's dispatcher, a btCollisionDispatcher, and what the patches' springs
  /// need of its solver: no split impulse, 50 iterations, a warm start of 1, two directions of
  /// friction, which a point may set (SOLVER_ENABLE_FRICTION_DIRECTION_CACHING). This object must
  /// outlive the world.
  void configure(btDynamicsWorld& world);

  /// Registers the algorithm for all types that collide with a Shape; warn() reports the others.
  /// Call it after the registration of other algorithms that take all types, as GImpact's does.
  /// This object must outlive the dispatcher.
  void register_with(btCollisionDispatcher& dispatcher);

  Settings settings;  ///< change between steps
  /// Changes a copy of the settings for a pair; called in every step in which the pair may touch,
  /// on the pair's thread.
  std::function<void(const btCollisionObject& first, const btCollisionObject& second,
                     Settings& settings)>
      of_pair;

  /// Called by the world after a step's motion. Pairs in which a body has a
  /// getCcdMotionThreshold(), and in which a point moves by more relative to the other body, are
  /// moved back to where they overlap by a quarter of the threshold. Bodies in contact keep
  /// moving while their mean depth is below that, and deeper ones while it grows by less. The rest
  /// of the motion is lost, as with Bullet's own sweeps, and with it the speed that gravity gave. A
  /// body that a contact lets get on by less than a sixteenth of its motion is jammed, and loses up
  /// to half of its speed: else it would turn on in slow motion.
  ///
  /// Response::solver only. A compound is stopped by its children, by the table of
  /// docs/engines.md. Links of multibodies are not stopped, since Bullet's broad phase does not
  /// look ahead for them; warn() says so. For a body that is hit in the same step, its motion
  /// before the hit counts.
  void updateAction(btCollisionWorld* world, btScalar step) override;
  void debugDraw(btIDebugDraw*) override {}

  /// The settings of a pair.
  Settings settings_of(const btCollisionObject& first, const btCollisionObject& second) const;

 private:
  struct CreateFunc : btCollisionAlgorithmCreateFunc {
    Contacts* contacts = nullptr;
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper* a,
                                                   const btCollisionObjectWrapper* b) override;
  };
  /// The passage of a pair in the last step: see PairAlgorithm::passage().
  Passage passage_of(const btCollisionAlgorithm* algorithm, const btCollisionObject& first,
                     const btCollisionObject& second, btScalar step) const;

  CreateFunc create_;
  std::vector<const btCollisionObject*> jammed_;  // in the last step
};

/// One pair of objects whose boxes overlap, or of a child of a compound. Bullet creates and
/// destroys it.
///
/// Events are Bullet's: gContactStartedCallback when a pair begins to touch, gContactEndedCallback
/// when it no longer does, both with its first manifold, and gContactProcessedCallback for every
/// point in every step. A point persists as long as its patch keeps its id. gContactAddedCallback
/// may change a point in every step; what it sets of the spring lasts until the point is computed
/// again.
class PairAlgorithm : public btActivatingCollisionAlgorithm {
 public:
  PairAlgorithm(const btCollisionAlgorithmConstructionInfo& info, const Contacts& contacts,
                const btCollisionShape& first, const btCollisionShape& second);
  ~PairAlgorithm() override;

  /// With Response::solver, fills the manifolds or moves their points (Settings::follow). A result
  /// that collects points (contactTest, contactPairTest) receives them instead.
  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                        const btDispatcherInfo& info, btManifoldResult* result) override;

  /// Response::wrench: applies the law's force at the current transforms to both bodies, for a step
  /// of `step` [s]. Compounds are not pushed.
  void push(const btCollisionObject& first, const btCollisionObject& second, double step);

  /// The force that push() last applied to the second object; the first got the opposite.
  const ContactForce& pushed() const;

  /// How far two bodies get in a motion: see Contacts::updateAction(). All of it, where it exceeds
  /// no getCcdMotionThreshold().
  Passage passage(const btCollisionObject& first, const btCollisionObject& second,
                  const std::array<btTransform, 2>& from,
                  const std::array<btTransform, 2>& to) const;

  /// The same for the motion from world transforms to interpolation transforms.
  btScalar calculateTimeOfImpact(btCollisionObject* first, btCollisionObject* second,
                                 const btDispatcherInfo&, btManifoldResult*) override {
    return static_cast<btScalar>(
        passage(*first, *second, {first->getWorldTransform(), second->getWorldTransform()},
                {first->getInterpolationWorldTransform(), second->getInterpolationWorldTransform()})
            .share);
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override;

 private:
  // Bullet's pool of algorithms has slots of a fixed size, which a release build does not check.
  struct State;

  const Contacts& contacts_;
  std::unique_ptr<State> state_;
};

/// Visits every pair of the world that has a PairAlgorithm, with its two objects.
template <class Visit>
void for_each_pair(btCollisionWorld& world, const Visit& visit) {
  btBroadphasePairArray& pairs = world.getPairCache()->getOverlappingPairArray();
  for (int i = 0; i < pairs.size(); ++i) {
    auto* const pair = dynamic_cast<PairAlgorithm*>(pairs[i].m_algorithm);
    if (pair == nullptr) continue;
    visit(*pair, *static_cast<btCollisionObject*>(pairs[i].m_pProxy0->m_clientObject),
          *static_cast<btCollisionObject*>(pairs[i].m_pProxy1->m_clientObject));
  }
}

/// Applies the law's forces before every substep of the world: Settings::Response::wrench.
///
/// A pair whose boxes begin to overlap in a step is pushed from the next step on. This uses the
/// world's callback before the tick.
inline void push_in_every_tick(btDynamicsWorld& world) {
  world.setInternalTickCallback(
      [](btDynamicsWorld* stepped, btScalar step) {
        for_each_pair(*stepped,
                      [step](PairAlgorithm& pair, const btCollisionObject& first,
                             const btCollisionObject& second) { pair.push(first, second, step); });
      },
      world.getWorldUserInfo(), true);
}

}  // namespace ist::bullet
