#include <ist/bullet/contacts.h>

#include <BulletCollision/CollisionDispatch/btCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btConvexConvexAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <LinearMath/btTransformUtil.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <typeinfo>

#include <ist/bullet/convert.h>

#include "bullet/points.h"

namespace ist::bullet {

namespace {

btRigidBody* movable(const btCollisionObject& object) {
  btRigidBody* const body = btRigidBody::upcast(const_cast<btCollisionObject*>(&object));
  return body != nullptr && body->getInvMass() > 0 ? body : nullptr;
}

/// The place of an object some time ago, by its velocity.
btTransform moved_back(const btCollisionObject& object, btScalar time) {
  btTransform before = object.getWorldTransform();
  const btRigidBody* const body = movable(object);
  if (body != nullptr && body->isActive()) {
    btTransformUtil::integrateTransform(object.getWorldTransform(), -body->getLinearVelocity(),
                                        -body->getAngularVelocity(), time, before);
  }
  return before;
}

/// [u] The motion in a step above which impacts count.
double fast_motion(const btCollisionObject& first, const btCollisionObject& second) {
  double least = std::numeric_limits<double>::infinity();
  for (const btCollisionObject* object : {&first, &second}) {
    const double squared = object->getCcdSquareMotionThreshold();
    if (squared > 0) least = std::min(least, std::sqrt(squared));
  }
  return least;
}

/// Calls `visit(shape, in_body)` for a shape, or for the parts of a compound.
template <class Visit>
void for_each_part(const btCollisionShape& shape, const btTransform& in_body, const Visit& visit) {
  if (!shape.isCompound()) return visit(shape, in_body);
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  for (int i = 0; i < compound.getNumChildShapes(); ++i)
    for_each_part(*compound.getChildShape(i), in_body * compound.getChildTransform(i), visit);
}

Unsaid unsaid_motion(const btCollisionObject& object, const btTransform& before,
                     const btTransform& now, btScalar step) {
  Unsaid motion;
  if (!object.isKinematicObject()) return motion;
  btTransformUtil::calculateVelocity(before, now, step, motion.velocity, motion.turning);
  motion.origin = now.getOrigin();
  if (const btRigidBody* const body = btRigidBody::upcast(&object)) {
    motion.velocity -=
        body->getVelocityInLocalPoint(motion.origin - body->getCenterOfMassPosition());
    motion.turning -= body->getAngularVelocity();
  }
  return motion;
}

bool is_valid(const Settings& settings) {
  const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
  const auto from_0 = [](double x) { return x >= 0 && std::isfinite(x); };
  return settings.patches > 0 && positive(settings.depth) && from_0(settings.damping) &&
         from_0(settings.thickness) && from_0(settings.push_out) && from_0(settings.follow) &&
         from_0(settings.law.stiffness);
}

/// [u] The motion during which points are moved along instead of queried again.
double motion_until_asked(const Contact& contact, const Settings& settings, const Spring& spring) {
  // Corners with fixed areas bear three times the torque of a face that tilts on its springs.
  constexpr double kFlat = 0.1;
  if (contact.flat) return kFlat * settings.follow * spring.rest;
  return std::min(settings.follow * std::max(spring.rest, mean_depth(contact)), spring.rest);
}

using Asked = std::tuple<std::size_t, double, Measure>;

/// What decides a contact beside the places of the bodies.
Asked asked_of(const Settings& settings) {
  return {settings.patches, settings.thickness, settings.query.measure};
}

}  // namespace

struct PairAlgorithm::State {
  State(const btCollisionShape& first, const btCollisionShape& second, const Contacts& world)
      : meeting(first, second, &world) {}

  // A step of a pair that stays apart reads only these, which share few cache lines.
  btTransform second_in_first;  // at the last query
  double still = -1;            // [u] the answer is valid until a point has moved by more than this
  bool apart = true;            // it has no points
  bool has_before = false;
  Meeting meeting;
  Places before;  // the shapes' places in the last step, if `has_before`
  Points points;
  Spring spring;  // of the points
  Asked asked;
  ContactMemory memory;
  ContactForce pushed;
};

Settings Contacts::settings_of(const btCollisionObject& first,
                               const btCollisionObject& second) const {
  Settings of = settings;
  if (of_pair) of_pair(first, second, of);
  if (is_valid(of)) return of;
  warn("Invalid settings (NaN, negative, no patches or no depth): the default settings are used.",
       this);
  Settings defaults;
  defaults.response = of.response;
  return defaults;
}

void Contacts::register_with(btCollisionDispatcher& dispatcher) {
  create_.contacts = this;
  for (int other = 0; other < MAX_BROADPHASE_COLLISION_TYPES; ++other) {
    // Bullet decomposes compounds and queries their children.
    if (other == COMPOUND_SHAPE_PROXYTYPE || other == EMPTY_SHAPE_PROXYTYPE) continue;
    for (const auto& [a, b] : {std::pair<int, int>{CUSTOM_CONCAVE_SHAPE_TYPE, other},
                               std::pair<int, int>{other, CUSTOM_CONCAVE_SHAPE_TYPE}}) {
      dispatcher.registerCollisionCreateFunc(a, b, &create_);
      dispatcher.registerClosestPointsCreateFunc(a, b, &create_);
    }
  }
}

void Contacts::configure(btDynamicsWorld& world) {
  register_with(dynamic_cast<btCollisionDispatcher&>(*world.getDispatcher()));
  btContactSolverInfo& solver = world.getSolverInfo();
  solver.m_splitImpulse = false;    // the patches' springs push by speed
  solver.m_numIterations = 50;      // a stack is a chain of contacts
  solver.m_warmstartingFactor = 1;  // else friction is too weak at the beginning of every step
  solver.m_solverMode |=
      SOLVER_USE_2_FRICTION_DIRECTIONS | SOLVER_ENABLE_FRICTION_DIRECTION_CACHING;
}

void Contacts::updateAction(btCollisionWorld* world, btScalar step) {
  btBroadphasePairArray& pairs = world->getPairCache()->getOverlappingPairArray();
  btDispatcher& dispatcher = *world->getDispatcher();
  const auto objects_of = [](const btBroadphasePair& pair) {
    return std::array{static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject),
                      static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject)};
  };
  constexpr btScalar kJammed = 16;
  jammed_.clear();
  // All impacts are found before anything is moved, so the order of pairs does not matter.
  for (int i = 0; i < pairs.size(); ++i) {
    const auto& [first, second] = objects_of(pairs[i]);
    if (!std::isfinite(fast_motion(*first, *second))) continue;
    // No algorithm: the dispatcher's callback lets them pass.
    if (pairs[i].m_algorithm == nullptr || !dispatcher.needsCollision(first, second) ||
        !dispatcher.needsResponse(first, second))
      continue;
    for (const btCollisionObject* object : {first, second}) {
      if (object->getInternalType() == btCollisionObject::CO_FEATHERSTONE_LINK &&
          object->getCcdSquareMotionThreshold() > 0) {
        warn(
            "A link of a multibody has a CCD threshold, but Contacts stops rigid bodies alone: "
            "take smaller steps.",
            this);
      }
    }
    const Passage passage = passage_of(pairs[i].m_algorithm, *first, *second, step);
    for (btCollisionObject* object : {first, second}) {
      object->setHitFraction(
          std::min(static_cast<btScalar>(passage.share), object->getHitFraction()));
      if (passage.touched && kJammed * passage.share < 1) jammed_.push_back(object);
    }
  }
  for (int i = 0; i < pairs.size(); ++i) {
    for (btCollisionObject* object : objects_of(pairs[i])) {
      const btScalar share = object->getHitFraction(), lost = step * (1 - share);
      object->setHitFraction(1);
      btRigidBody* const body = movable(*object);
      if (body == nullptr || !(lost > 0)) continue;
      body->setCenterOfMassTransform(moved_back(*body, lost));
      body->setLinearVelocity(body->getLinearVelocity() - lost * body->getGravity());
      if (std::find(jammed_.begin(), jammed_.end(), object) == jammed_.end()) continue;
      const btScalar kept = std::max(btScalar(0.5), kJammed * share);
      body->setLinearVelocity(kept * body->getLinearVelocity());
      body->setAngularVelocity(kept * body->getAngularVelocity());
    }
  }
}

Passage Contacts::passage_of(const btCollisionAlgorithm* algorithm, const btCollisionObject& first,
                             const btCollisionObject& second, btScalar step) const {
  const Places from = {moved_back(first, step), moved_back(second, step)};
  const Places to = {first.getWorldTransform(), second.getWorldTransform()};
  if (const auto* const pair = dynamic_cast<const PairAlgorithm*>(algorithm))
    return pair->passage(first, second, from, to);
  // Bullet does not show the algorithms of a compound's children.
  const btCollisionShape &shape = *first.getCollisionShape(), &other = *second.getCollisionShape();
  Passage least;
  if (!shape.isCompound() && !other.isCompound()) return least;
  const double threshold = fast_motion(first, second);
  const Settings settings = settings_of(first, second);
  for_each_part(shape, btTransform::getIdentity(),
                [&](const btCollisionShape& part, const btTransform& in_body) {
                  for_each_part(other, btTransform::getIdentity(),
                                [&](const btCollisionShape& met, const btTransform& in_other) {
                                  const Passage one = Meeting(part, met, this)
                                                          .passage(from, to, {in_body, in_other},
                                                                   threshold, settings);
                                  if (one.share < least.share) least = one;
                                });
                });
  return least;
}

btCollisionAlgorithm* Contacts::CreateFunc::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
    const btCollisionObjectWrapper* b) {
  static_assert(sizeof(PairAlgorithm) <= sizeof(btConvexConvexAlgorithm));
  const btCollisionShape &first = *a->getCollisionShape(), &second = *b->getCollisionShape();
  const Meeting meeting(first, second);
  if (!meeting.has_shape()) {
    return static_cast<btCollisionDispatcher*>(info.m_dispatcher1)
        ->getCollisionConfiguration()
        ->getCollisionAlgorithmCreateFunc(first.getShapeType(), second.getShapeType())
        ->CreateCollisionAlgorithm(info, a, b);
  }
  if (!meeting.is_met()) {
    warn((std::string(first.getName()) + " and " + second.getName() +
          " do not meet: they pass through each other. docs/engines.md lists what an asset meets, "
          "and what to use in place of the rest.")
             .c_str(),
         contacts);
  }
  if (meeting.is_coarse()) {
    warn((std::string((dynamic_cast<const Shape*>(&first) != nullptr ? second : first).getName()) +
          " is small against what the spheres of an asset leave uncovered, and sinks in until it "
          "meets them: bake the asset with more spheres, or the small body as an asset too.")
             .c_str(),
         contacts);
  }
  void* const place = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(PairAlgorithm));
  return new (place) PairAlgorithm(info, *contacts, first, second);
}

PairAlgorithm::PairAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                             const Contacts& contacts, const btCollisionShape& first,
                             const btCollisionShape& second)
    : btActivatingCollisionAlgorithm(info),
      contacts_(contacts),
      state_(new State(first, second, contacts)) {}

PairAlgorithm::~PairAlgorithm() { state_->points.release(*m_dispatcher); }

void PairAlgorithm::processCollision(const btCollisionObjectWrapper* a,
                                     const btCollisionObjectWrapper* b,
                                     const btDispatcherInfo& info, btManifoldResult* result) {
  if (!state_->meeting.is_met()) return;
  const btCollisionObject &first = *a->getCollisionObject(), &second = *b->getCollisionObject();
  const btTransform &at_first = a->getWorldTransform(), &at_second = b->getWorldTransform();
  const btTransform second_in_first = at_first.inverseTimes(at_second);
  const bool holds =
      state_->still > 0 &&
      state_->meeting.largest_motion(state_->second_in_first, second_in_first) <= state_->still;
  const bool placed = first.isKinematicObject() || second.isKinematicObject();
  // Most pairs of a heap are apart and stay apart.
  if (holds && state_->apart && !placed && typeid(*result) == typeid(btManifoldResult)) {
    state_->has_before = false;
    return;
  }
  const Settings settings = contacts_.settings_of(first, second);
  if (typeid(*result) != typeid(btManifoldResult)) {
    // contactTest() and similar functions collect points through a manifold.
    Contact contact;
    state_->meeting.find(at_first, at_second, settings, contact);
    result->setPersistentManifold(state_->points.first_manifold(first, second, *m_dispatcher));
    for (std::size_t i = 0; i < contact.count; ++i) {
      const ContactPatch& patch = contact.patches[i];
      if (!(patch.area > 0)) continue;
      const Eigen::Vector3d normal = -patch.normal;
      result->addContactPoint(
          to_bullet(normal),
          to_bullet(Eigen::Vector3d(place_of(patch) + 0.5 * patch.depth * normal)),
          static_cast<btScalar>(-patch.depth));
    }
    const double most = result->m_closestPointDistanceThreshold;
    if (contact.count == 0 && most > 0) {
      const Separation gap = state_->meeting.gap(at_first, at_second, settings, most);
      if (gap.distance > 0 && gap.distance < most)
        result->addContactPoint(to_bullet(Eigen::Vector3d(-gap.normal)), to_bullet(gap.point_b),
                                static_cast<btScalar>(gap.distance));
    }
    result->setPersistentManifold(nullptr);
    return;
  }
  if (settings.response != Settings::Response::solver) {
    if (a->m_parent != nullptr || b->m_parent != nullptr) {
      warn(
          "Settings::Response::wrench pushes no compounds: they pass through each other. Use "
          "Response::solver for their pairs.",
          &contacts_);
    }
    return;
  }
  const double step = info.m_timeStep > 0 ? info.m_timeStep : 1.0 / 60;
  if (state_->has_before) {
    const auto time = static_cast<btScalar>(step);
    state_->points.unsaid = {unsaid_motion(first, state_->before[0], at_first, time),
                             unsaid_motion(second, state_->before[1], at_second, time)};
  }
  state_->before = {at_first, at_second};
  state_->has_before = true;
  const Spring spring = spring_of(state_->meeting, first, second, settings, step);
  if (holds && spring.is_like(state_->spring) && asked_of(settings) == state_->asked) {
    state_->points.move(*a, *b, step);
  } else {
    Contact contact;
    state_->meeting.find(at_first, at_second, settings, contact, state_->apart);
    state_->points.fill(*a, *b, contact, spring, *m_dispatcher);
    state_->spring = spring;
    state_->asked = asked_of(settings);
    state_->second_in_first = second_in_first;
    state_->still = std::max(motion_until_asked(contact, settings, spring), contact.clearance);
    state_->apart = state_->points.count() == 0;
  }
  if (gContactProcessedCallback == nullptr) return;
  for (btPersistentManifold* manifold : state_->points.manifolds) {
    for (int i = 0; i < manifold->getNumContacts(); ++i) {
      gContactProcessedCallback(manifold->getContactPoint(i),
                                const_cast<btCollisionObject*>(&first),
                                const_cast<btCollisionObject*>(&second));
    }
  }
}

Passage PairAlgorithm::passage(const btCollisionObject& first, const btCollisionObject& second,
                               const Places& from, const Places& to) const {
  return state_->meeting.passage(from, to, {btTransform::getIdentity(), btTransform::getIdentity()},
                                 fast_motion(first, second), contacts_.settings_of(first, second));
}

void PairAlgorithm::getAllContactManifolds(btManifoldArray& manifolds) {
  for (btPersistentManifold* manifold : state_->points.manifolds) manifolds.push_back(manifold);
}

const ContactForce& PairAlgorithm::pushed() const { return state_->pushed; }

void PairAlgorithm::push(const btCollisionObject& first, const btCollisionObject& second,
                         double step) {
  state_->pushed = {};
  if (!state_->meeting.is_met()) return;
  Settings settings = contacts_.settings_of(first, second);
  const bool whole = settings.law.area > 0;
  if (whole) settings.patches = 1;
  Contact contact;
  state_->meeting.find(first.getWorldTransform(), second.getWorldTransform(), settings, contact);
  if (!(contact.whole.volume > 0) || contact.inside) {
    state_->memory = {};
    return;
  }
  if (whole) contact.patches[0] = whole_patch(contact.whole);  // with the same name in every pose

  btRigidBody* const b = movable(second);
  btRigidBody* const a = movable(first);
  const auto motion_of = [&](const btRigidBody* moved) {  // of its point at B's origin
    if (moved == nullptr) return Motion();
    const Eigen::Vector3d velocity = to_eigen(moved->getLinearVelocity()),
                          turning = to_eigen(moved->getAngularVelocity()),
                          centre = to_eigen(moved->getCenterOfMassPosition());
    return Motion{velocity + turning.cross(contact.origin - centre), turning};
  };
  const Motion of_a = motion_of(a), of_b = motion_of(b);
  const Motion motion{of_b.velocity - of_a.velocity, of_b.angular_velocity - of_a.angular_velocity};
  ContactLaw law = settings.law;
  law.stiffness = spring_of(state_->meeting, first, second, settings, step).stiffness;
  law.friction = gCalculateCombinedFrictionCallback(&first, &second);
  state_->pushed = contact_force(law, std::span(contact.patches).first(contact.count), motion,
                                 contact.origin, step, state_->memory);
  // Impulses, since forces would act again in every further substep of one stepSimulation().
  const auto give = [&](btRigidBody* moved, double sign) {
    if (moved == nullptr) return;
    const Eigen::Vector3d arm = contact.origin - to_eigen(moved->getCenterOfMassPosition());
    const ContactForce& f = state_->pushed;
    moved->applyCentralImpulse(to_bullet(Eigen::Vector3d(sign * step * f.force)));
    moved->applyTorqueImpulse(
        to_bullet(Eigen::Vector3d(sign * step * (f.torque + arm.cross(f.force)))));
  };
  give(b, 1);
  give(a, -1);
}

}  // namespace ist::bullet
