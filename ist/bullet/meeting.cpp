#include "bullet/meeting.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <ist/bullet/convert.h>

namespace ist::bullet {

namespace {

PlacedTree placed(const Shape& shape, const btTransform& at) {
  return {shape.tree(), to_pose(at * shape.mesh_in_body()), shape.scale()};
}

/// Of the thread: a query's scratch memory.
Workspace& workspace() {
  thread_local Workspace memory;
  return memory;
}

struct Body {
  double mass = std::numeric_limits<double>::infinity();
  double gravity = 0;  // [u/s²]
};

Body body_of(const btCollisionObject& object) {
  if (object.isStaticOrKinematicObject()) return {};
  if (const auto* const rigid = btRigidBody::upcast(&object)) {
    if (rigid->getInvMass() > 0) return {1.0 / rigid->getInvMass(), rigid->getGravity().length()};
  } else if (const auto* const link = btMultiBodyLinkCollider::upcast(&object)) {
    const btMultiBody& robot = *link->m_multiBody;
    return {link->m_link < 0 ? robot.getBaseMass() : robot.getLinkMass(link->m_link), 0};
  }
  return {};
}

}  // namespace

Meeting::Meeting(const btCollisionShape& first, const btCollisionShape& second) {
  // SDF shapes of Bullet's have the same type.
  const auto* const one = dynamic_cast<const Shape*>(&first);
  const auto* const other = dynamic_cast<const Shape*>(&second);
  b_is_second_ = other != nullptr;
  b_ = b_is_second_ ? other : one;
  if (b_ == nullptr) return;
  a_ = b_is_second_ ? one : nullptr;
  if (a_ == nullptr) partner_ = Partner::of(b_is_second_ ? first : second);
}

double Meeting::volume() const {
  return a_ != nullptr ? std::min(a_->volume(), b_->volume()) : b_->volume();
}

double Meeting::stiffness() const {
  if (a_ == nullptr || a_->stiffness <= 0) return b_->stiffness;
  return b_->stiffness <= 0 ? a_->stiffness : stiffness_in_series(a_->stiffness, b_->stiffness);
}

double Meeting::largest_motion(const btTransform& before, const btTransform& now) const {
  // A turn by θ moves what is R away by 2 R sin(θ/2), and two bases differ by √8 sin(θ/2).
  const auto motion = [reach = b_->reach()](const btTransform& from, const btTransform& to) {
    double turned = 0;
    for (int i = 0; i < 3; ++i) turned += (to.getBasis()[i] - from.getBasis()[i]).length2();
    return (to.getOrigin() - from.getOrigin()).length() + reach * std::sqrt(0.5 * turned);
  };
  return b_is_second_ ? motion(before, now) : motion(before.inverse(), now.inverse());
}

void Meeting::find(const btTransform& first, const btTransform& second, const Settings& settings,
                   Contact& contact) const {
  const btTransform& at_a = b_is_second_ ? first : second;
  const PlacedTree b = placed(*b_, b_is_second_ ? second : first);
  const std::span room(contact.patches.data(), std::min(settings.patches, Settings::kPatches));
  contact.pushes_second = b_is_second_;
  contact.origin = Eigen::Vector3d(b.pose.t);
  contact.clearance = 0;
  ContactPatches found;
  if (a_ == nullptr) {
    found = contact_patches(partner_->placed(at_a), b, settings.query, workspace(), room);
  } else {
    const PlacedTree a = placed(*a_, at_a);
    ContactSettings query = settings.query;
    found = contact_patches(a, b, query, workspace(), room);
    if (found.penetration.status == QueryStatus::not_held && query.field == FieldUse::always) {
      query.field = FieldUse::automatic;
      found = contact_patches(a, b, query, workspace(), room);
    }
    if (found.penetration.volume_max <= 0) {
      // A lower bound suffices: the first few nodes give one.
      constexpr SeparationSettings kGlance{.max_visits = 8, .inner_spheres = true};
      contact.clearance = separation(a, b, kGlance, workspace()).distance_min -
                          a.scale * a.tree.protrusion() - b.scale * b.tree.protrusion();
    }
  }
  if (std::isnan(found.penetration.volume)) {
    warn(
        "A contact query gave no answer, so two bodies pass through each other: a transform is not "
        "finite, or Settings::query needs what an asset does not hold.");
    contact.clearance = 0;
  }
  contact.whole = found.penetration;
  contact.count = found.count;
}

bool find_contact(const btCollisionObject& first, const btCollisionObject& second,
                  const Settings& settings, Contact& contact) {
  const Meeting meeting(*first.getCollisionShape(), *second.getCollisionShape());
  if (!meeting.is_met()) return false;
  meeting.find(first.getWorldTransform(), second.getWorldTransform(), settings, contact);
  return true;
}

Spring spring_of(const Meeting& meeting, const btCollisionObject& first,
                 const btCollisionObject& second, const Settings& settings, double step) {
  const Body one = body_of(first), other = body_of(second);
  const Body& lighter = one.mass < other.mass ? one : other;
  const double size = std::cbrt(meeting.volume()), face = size * size;
  Spring spring;
  spring.stiffness = settings.law.stiffness > 0 ? settings.law.stiffness : meeting.stiffness();
  spring.linear = std::numeric_limits<double>::infinity();
  if (!std::isfinite(lighter.mass)) return spring;  // nothing moves
  if (!(spring.stiffness > 0)) {
    const double rest = settings.depth * size;
    spring.linear = rest;
    const double pull = lighter.gravity > 0 ? lighter.gravity : rest / (step * step);
    spring.stiffness = stiffness_for_depth(lighter.mass * pull, face, rest);
  }
  const double held = spring.stiffness * face / lighter.mass;  // [1/s²]
  spring.rest = (lighter.gravity > 0 ? lighter.gravity / held : settings.depth * size);
  spring.slow = std::sqrt(2 * held) * spring.rest;
  spring.relaxation = 2 * settings.damping / std::sqrt(held);
  return spring;
}

}  // namespace ist::bullet
