#pragma once

#include <BulletCollision/CollisionDispatch/btActivatingCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletDynamics/Dynamics/btDynamicsWorld.h>

#include <array>
#include <cstddef>
#include <functional>
#include <memory>

#include <ist/bullet/shape.h>
#include <ist/query.h>
#include <ist/response.h>

// How assets collide in Bullet: docs/engines.md. Link ist::bullet where Bullet is its
// single-precision build, ist::bullet-float64 where it is the one with BT_USE_DOUBLE_PRECISION.

namespace ist::bullet {

/// How contacts are found and what they do.
struct Settings {
  static constexpr std::size_t kPatches = ContactMemory::kPatches;

  enum class Response {
    solver,  ///< patches are springs among the contact points of Bullet's solver
    wrench,  ///< push_in_every_tick() applies the force of `law`, Bullet sees no contact
  };
  Response response = Response::solver;
  std::size_t patches = 8;  ///< [1, kPatches] a contact
  /// `always` where flat faces meet. Assets without a surface (TreeView::has_field) use lenses.
  ContactSettings query{.field = FieldUse::always};

  /// law.stiffness [force/u³] is the pressure over depth, in both ways. The solver takes it
  /// implicitly, at any size, and needs no more of the law; the wrench is bound to what the step
  /// bears. With law.area every wrench is one patch. Friction is Bullet's, of the two bodies.
  ///
  /// 0: that of the two shapes (Shape::stiffness, two in series), or else by `depth`.
  ContactLaw law;
  /// Where no stiffness is given: the lighter body rests by its weight at this depth, as a share of
  /// the smaller asset's size, on a face of that size. The size is the cube root of the volume.
  /// Deeper, the pressure grows with the depth's square, so that a body bears a hundred times its
  /// weight ten times as deep. A body without gravity is held as fast as a step resolves.
  ///
  /// Flat faces of spheres are blurred. The deeper, the nearer they rest to their place; the less
  /// deep, the higher a stack stands.
  double depth = 0.001;
  /// Of a contact, over the critical one; solver only. At 1 what has no restitution comes off with
  /// less than a seventh of its speed, e⁻².
  double damping = 1;
  /// Solver only: two objects are asked about again once a point of one has moved by more than this
  /// against the other, as a share of the depth at which the lighter rests. Until then their
  /// patches move along, as much deeper as that motion makes them, of the same areas. A contact
  /// that begins is seen this late. 0: asked in every step.
  double follow = 0.05;
};

/// A contact of two objects.
struct Contact {
  bool pushes_second = true;  ///< the normals push the second object, or else the first
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< [u] about which torques turn it, world
  Penetration whole;                                 ///< the contact as one
  std::size_t count = 0;
  std::array<ContactPatch, Settings::kPatches> patches;
  /// [u] Of objects that do not touch: nor do they while no point has moved by more than this.
  double clearance = 0;
};

/// The contact of two objects at their transforms of now, by Settings::patches and query. False if
/// neither is a Shape or one cannot be met; compounds are not taken apart.
bool find_contact(const btCollisionObject& first, const btCollisionObject& second,
                  const Settings& settings, Contact& contact);

/// Answers for a dispatcher's pairs of which one is a Shape. Scratch memory is the thread's, so
/// that btCollisionDispatcherMt may ask on many.
class Contacts {
 public:
  /// For all that a Shape meets; warn() tells of what it does not. Comes after other algorithms
  /// that take all types, as GImpact's does. Must outlive the dispatcher.
  void register_with(btCollisionDispatcher& dispatcher);

  Settings settings;  ///< change between steps
  /// Changes a copy of the settings for a pair; called in every step, on the pair's thread.
  std::function<void(const btCollisionObject& first, const btCollisionObject& second,
                     Settings& settings)>
      of_pair;

  /// Those of a pair.
  Settings settings_of(const btCollisionObject& first, const btCollisionObject& second) const;

 private:
  struct CreateFunc : btCollisionAlgorithmCreateFunc {
    Contacts* contacts = nullptr;
    btCollisionConfiguration* others = nullptr;
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper* a,
                                                   const btCollisionObjectWrapper* b) override;
  };
  CreateFunc create_;
};

/// One pair of objects whose boxes overlap, or of a child of a compound. Bullet makes and ends it.
///
/// Events are Bullet's: gContactStartedCallback when a pair begins to touch, gContactEndedCallback
/// when it no longer does, both with its first manifold, and gContactProcessedCallback for every
/// point in every step. A point is the same as long as its patch has the same name.
/// gContactAddedCallback may change a point whenever it was computed.
class PairAlgorithm : public btActivatingCollisionAlgorithm {
 public:
  PairAlgorithm(const btCollisionAlgorithmConstructionInfo& info, const Contacts& contacts,
                const btCollisionShape& first, const btCollisionShape& second);
  ~PairAlgorithm() override;

  /// Fills the manifolds where the solver is to answer, or moves what is in them
  /// (Settings::follow). A result that collects points (contactTest, contactPairTest) gets them
  /// instead.
  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                        const btDispatcherInfo& info, btManifoldResult* result) override;

  /// Pushes both bodies by the law's force for a step of `step` [s], as of where they are now:
  /// Response::wrench. Compounds are not pushed.
  void push(const btCollisionObject& first, const btCollisionObject& second, double step);

  /// What push() did last, and the object on which it did that.
  const ContactForce& pushed() const;
  const btCollisionObject* pushed_body() const;

  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override;

 private:
  // Bullet's pool of algorithms has places of a fixed size, which nobody checks in a release build.
  struct State;

  const Contacts& contacts_;
  std::unique_ptr<State> state_;
};

/// Every pair of the world that a PairAlgorithm answers for, and its two objects.
template <class Visit>
void for_each_pair(btDynamicsWorld& world, const Visit& visit) {
  btBroadphasePairArray& pairs = world.getPairCache()->getOverlappingPairArray();
  for (int i = 0; i < pairs.size(); ++i) {
    auto* const pair = dynamic_cast<PairAlgorithm*>(pairs[i].m_algorithm);
    if (pair == nullptr) continue;
    visit(*pair, *static_cast<btCollisionObject*>(pairs[i].m_pProxy0->m_clientObject),
          *static_cast<btCollisionObject*>(pairs[i].m_pProxy1->m_clientObject));
  }
}

/// Has the law's forces applied before every substep of the world: Settings::Response::wrench.
///
/// Boxes that begin to overlap in a step are known to it from the next on. Takes the world's tick
/// callback before the step.
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
