#include "bullet/meeting.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <LinearMath/btTransformUtil.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <ist/bullet/convert.h>
#include <ist/contact_law.h>
#include <ist/mass_properties.h>
#include <ist/raycast.h>

namespace ist::bullet {

namespace {

/// The scratch memory of the thread's queries.
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

/// The distance up to which flat faces of meshes push, relative to the smaller solid's size.
constexpr double kReach = 0.02;

/// For two assets whose meshes do not overlap: a push where they touch or are nearest, for
/// SupportPolygon.
std::optional<Penetration> push_across(const Penetration& apart, const Separation& gap,
                                       double reach, const Eigen::Vector3d& origin_b) {
  Penetration push = apart;
  Eigen::Vector3d normal = push.contact_normal;
  if (!push.touching) {
    push.centroid = (gap.point_a + gap.point_b) / 2;
    normal = gap.normal;
  }
  if (!(normal.squaredNorm() > 0)) return std::nullopt;
  constexpr double kHardly = 1e-6;  // the magnitude does not matter
  const Eigen::Vector3d force = kHardly * (reach * reach) * normal;
  push.volume = 0;
  push.force = force;
  push.torque = (push.centroid - origin_b).cross(force);
  return push;
}

}  // namespace

Meeting::Meeting(const btCollisionShape& first, const btCollisionShape& second,
                 const Contacts* world)
    // Bullet's own SDF shapes have the same type.
    : first_(dynamic_cast<const Shape*>(&first)),
      second_(dynamic_cast<const Shape*>(&second)),
      world_(world),
      pair_id_(static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(this) >> 3)) {
  if (has_shape() && first_ == nullptr) partner_ = Partner::of(first);
  if (has_shape() && second_ == nullptr) partner_ = Partner::of(second);
}

Meeting::Solids Meeting::placed(const Places& at, const Places& to,
                                const Settings& settings) const {
  const auto one = [&](int i) -> PlacedSolid {
    const Shape* const shape = i == 0 ? first_ : second_;
    if (shape != nullptr)
      return {shape->tree(), to_pose(at[i] * shape->mesh_in_body()), shape->scale()};
    const Shape& other = i == 0 ? *second_ : *first_;
    btVector3 lower = at[i].inverseTimes(at[1 - i]).getOrigin(), upper = lower;
    lower.setMin(to[i].inverseTimes(to[1 - i]).getOrigin());
    upper.setMax(to[i].inverseTimes(to[1 - i]).getOrigin());
    const auto reach = static_cast<btScalar>(other.reach());
    return partner_->placed(at[i], lower - btVector3(reach, reach, reach),
                            upper + btVector3(reach, reach, reach), thickness_of(settings));
  };
  return {one(0), one(1)};
}

double Meeting::thickness_of(const Settings& settings) const {
  return settings.thickness > 0 ? settings.thickness : std::cbrt(volume());
}

double Meeting::volume() const {
  if (first_ == nullptr || second_ == nullptr) return (first_ ? first_ : second_)->volume();
  return std::min(first_->volume(), second_->volume());
}

double Meeting::stiffness() const {
  const double one = first_ != nullptr ? first_->stiffness : 0;
  const double other = second_ != nullptr ? second_->stiffness : 0;
  if (one <= 0 || other <= 0) return std::max(one, other);
  return stiffness_in_series(one, other);
}

double Meeting::largest_motion(const btTransform& before, const btTransform& now) const {
  // A rotation by θ moves a point at distance R by 2 R sin(θ/2), and two bases differ by √8
  // sin(θ/2).
  const auto motion = [reach = (second_ ? second_ : first_)->reach()](const btTransform& from,
                                                                      const btTransform& to) {
    double turned = 0;
    for (int i = 0; i < 3; ++i) turned += (to.getBasis()[i] - from.getBasis()[i]).length2();
    return (to.getOrigin() - from.getOrigin()).length() + reach * std::sqrt(0.5 * turned);
  };
  return second_ != nullptr ? motion(before, now) : motion(before.inverse(), now.inverse());
}

void Meeting::find(const btTransform& first, const btTransform& second, const Settings& settings,
                   Contact& contact, bool likely_apart) const {
  const auto& [a, b] = placed({first, second}, {first, second}, settings);
  const std::span room(contact.patches.data(), std::min(settings.patches, Settings::kPatches));
  contact.origin = std::visit([](const auto& at) { return Eigen::Vector3d(at.pose.t); }, b.placed);
  contact.clearance = 0;
  contact.whole = {};
  contact.count = 0;
  contact.flat = contact.inside = false;
  ContactSettings query = settings.query;
  query.pair_id = pair_id_;
  const auto keeps_mesh = [](const Shape* shape) {
    return shape != nullptr && shape->tree().has_mesh();
  };
  const bool exact = query.measure == Measure::exact && keeps_mesh(first_) && keeps_mesh(second_);
  if (query.measure == Measure::exact && !exact) query.measure = Measure::matched;
  const auto blur = [](const Shape* shape) {
    return shape != nullptr ? shape->scale() * shape->tree().protrusion() : 0;
  };
  // The distance up to which flat faces push: the protrusion of spheres, and the same for meshes.
  const double reach = exact ? kReach * std::cbrt(volume()) : blur(first_) + blur(second_);
  Separation gap;
  const auto find_gap = [&] {
    gap = separation(a, b, {.max_distance = 2 * reach, .pair_id = pair_id_}, workspace());
    return gap.distance_min > 0;
  };
  bool apart = false;  // certainly
  if (likely_apart) {
    // A lower bound suffices: the first few nodes give one.
    constexpr SeparationSettings kGlance{.max_visits = 8, .inner_spheres = true};
    double bound = separation(a, b, kGlance, workspace()).distance_min;
    if (std::isnan(bound)) bound = 0;  // no spheres
    if (partner_) bound = std::min(bound, partner_->clearance(thickness_of(settings)));
    if (bound > reach) {
      contact.clearance = bound - reach;
      return;
    }
    apart = exact && find_gap();
  }
  if (!apart) {
    const ContactPatches found = contact_patches(a, b, query, workspace(), room);
    contact.whole = found.penetration;
    contact.count = found.count;
    if (contact.whole.status == QueryStatus::budget_exhausted) {
      warn(
          "A limit of Settings::query stopped a contact query: what it had found until then "
          "pushes, "
          "and bodies may sink in.",
          world_);
    }
  }
  if (std::isnan(contact.whole.volume)) {
    warn(
        "A contact query gave no answer, so two bodies pass through each other: a transform is not "
        "finite, or Settings::query needs what an asset does not hold.",
        world_);
    return;
  }
  contact.inside = contact.whole.volume > 0 && find_way_out({a, b}, {first, second}, contact);
  const bool waits = exact && !(contact.whole.volume > 0);
  std::optional<Penetration> whole = contact.whole;
  if (waits) {
    if (!contact.whole.touching) {
      if (!apart) find_gap();
      contact.clearance = gap.distance_min - reach;
      if (contact.clearance > 0 || !(gap.distance > 0)) return;
      // Faces that do not face each other now may do so halfway.
      contact.clearance = gap.distance_min / 2;
    }
    whole = push_across(contact.whole, gap, reach, contact.origin);
    if (!whole) return;
  } else {
    // Patches of a flat contact push in similar directions.
    constexpr double kAlike = 0.99;
    double areas = 0;
    for (const ContactPatch& patch : room.first(contact.count)) areas += patch.area;
    if (contact.inside || !(whole->force.norm() > kAlike * areas)) return;
  }

  const auto radius = [](const Shape* shape) {
    return shape != nullptr ? shape->reach() : std::numeric_limits<double>::infinity();
  };
  const bool by_second = radius(second_) <= radius(first_);
  SupportPolygon polygon(*whole, contact.origin, to_eigen(by_second ? second : first).linear(),
                         2 * std::min(radius(first_), radius(second_)),
                         exact && !waits ? 0 : reach);
  // The side with fewer triangles first: in most contacts it is not flat.
  const auto triangles = [](const Shape* shape) {
    return shape != nullptr ? shape->tree().mesh_triangles() : 0;
  };
  const bool second_first = triangles(second_) < triangles(first_);
  for (const bool of_second : {second_first, !second_first}) {
    const PlacedSolid& solid = of_second ? b : a;
    if (!polygon.add(of_second, solid) && partner_)
      partner_->add_faces(std::get<PlacedShape>(solid.placed), of_second, polygon);
    if (!polygon.has_faces(of_second)) return;
  }
  const std::optional<std::size_t> corners = polygon.corners(room);
  if (!corners) return;
  contact.count = *corners;
  contact.flat = true;
  contact.clearance = 0;
}

Separation Meeting::gap(const btTransform& first, const btTransform& second,
                        const Settings& settings, double most) const {
  const auto& [a, b] = placed({first, second}, {first, second}, settings);
  return separation(a, b, {.max_distance = most}, workspace());
}

bool Meeting::is_coarse() const {
  constexpr double kThick = 0.05;  // of the partner's size
  if (!partner_ || !partner_->shape().isConvex()) return false;
  const Shape& asset = first_ != nullptr ? *first_ : *second_;
  btVector3 lower, upper;
  partner_->shape().getAabb(btTransform::getIdentity(), lower, upper);
  const Eigen::Vector3d sides = to_eigen(upper) - to_eigen(lower);
  const double layer = (1 - asset.tree().coverage()) * std::cbrt(asset.volume()) / 6;  // a cube's
  return layer > kThick * std::cbrt(sides.prod());
}

bool Meeting::find_way_out(const Solids& solids, const Places& at, Contact& contact) const {
  // If a solid is inside the other, its overlap is all of it and no motion changes it. The
  // remaining patches may push against each other.
  constexpr double kWhole = 0.99, kNone = 0.01;
  const double overlap = contact.whole.volume;
  if (!(contact.whole.force.norm() < kNone * std::pow(overlap, 2.0 / 3))) return false;
  for (const int inner : {0, 1}) {
    const Shape* const shape = inner == 0 ? first_ : second_;
    Eigen::Vector3d centre;
    double radius = 0;
    if (shape != nullptr) {
      if (!(overlap > kWhole * shape->volume())) continue;
      const Bounds box = bounds(shape->tree());
      centre = to_eigen(at[inner] * (shape->mesh_in_body() *
                                     to_bullet(Eigen::Vector3d(shape->scale() * box.centre))));
      radius = shape->scale() * box.radius;
    } else {
      btVector3 middle;
      btScalar reach;
      partner_->shape().getBoundingSphere(middle, reach);
      centre = to_eigen(at[inner] * middle);
      radius = reach;
    }
    const SurfacePoint near = closest_point(solids[1 - inner], centre);
    if (shape == nullptr && !(near.distance <= -radius)) continue;
    ContactPatch& exit_patch = contact.patches[0] = {};
    exit_patch.id = ~std::uint64_t{0};
    exit_patch.normal = inner == 1 ? near.gradient : Eigen::Vector3d(-near.gradient);
    exit_patch.depth = radius - near.distance;
    if (near.status != QueryStatus::ok) {  // it has no mesh
      const Eigen::Vector3d between = to_eigen(at[1].getOrigin() - at[0].getOrigin());
      exit_patch.normal =
          between.norm() > 0 ? Eigen::Vector3d(between.normalized()) : Eigen::Vector3d::UnitZ();
      exit_patch.depth = first_->reach() + second_->reach() - between.norm();
    }
    exit_patch.centroid = exit_patch.point = centre;
    exit_patch.area = std::pow(volume(), 2.0 / 3);
    exit_patch.volume = overlap;
    contact.count = 1;
    return true;
  }
  return false;
}

TimeOfImpact Meeting::impact(const Places& from, const Places& to, const Places& in_body,
                             const Settings& settings) const {
  const auto& [a, b] = placed(from * in_body, to * in_body, settings);
  const auto motion = [&](const Shape* shape, int i) {
    btTransform solid = in_body[i];
    if (shape != nullptr) solid *= shape->mesh_in_body();
    const double scale = shape != nullptr ? shape->scale() : 1;
    return motion_between(to_pose(from[i] * solid), to_pose(to[i] * solid), 1,
                          to_eigen(solid.inverse().getOrigin()) / scale, scale);
  };
  // A flat face above a mesh may need any number of visits; the excess is stopped early.
  const ImpactSettings limit{.max_visits = partner_ ? 1u << 13 : 0u};
  return time_of_impact(a, b, {motion(first_, 0), motion(second_, 1)}, limit, workspace());
}

Passage Meeting::passage(const Places& from, const Places& to, const Places& in_body,
                         double threshold, const Settings& settings) const {
  constexpr double kDepth = 0.25;  // of the threshold
  constexpr int kLooks = 24;
  if (!is_met() || settings.response != Settings::Response::solver) return {};
  const auto between = [&](const Places& at) {
    const Places shapes = at * in_body;
    return shapes[0].inverseTimes(shapes[1]);
  };
  const double motion = largest_motion(between(from), between(to));
  if (!(motion > threshold)) return {};
  const TimeOfImpact found = impact(from, to, in_body, settings);
  if (found.kind == ImpactKind::no_impact && found.status == QueryStatus::ok) return {};
  if (found.kind != ImpactKind::overlapping)
    return {std::min(1.0, found.time + kDepth * threshold / motion)};

  // In contact, their mean depth is most informative if they slide or turn, like a nut on its
  // thread.
  const auto depth_after = [&](double share) {
    Places at;
    for (std::size_t i = 0; i < 2; ++i) {
      btVector3 velocity, turning;
      btTransformUtil::calculateVelocity(from[i], to[i], 1, velocity, turning);
      btTransformUtil::integrateTransform(from[i], velocity, turning, static_cast<btScalar>(share),
                                          at[i]);
    }
    const Places shapes = at * in_body;
    Contact contact;
    find(shapes[0], shapes[1], settings, contact);
    return mean_depth(contact);
  };
  // Bodies that are already deeper are left to their springs: if nothing could get deeper, a heap
  // of bodies would stand still and keep its speeds.
  const double stride = std::max(threshold / motion, 1.0 / kLooks);
  const double deep = kDepth * threshold, begins = depth_after(0);
  const double most = begins < deep ? deep : begins + deep;
  const double least = stride / 8;  // else two bodies that turn into each other would stop forever
  double share = 0, next = stride;
  for (int looks = 0; looks < kLooks && share < 1 && next >= least; ++looks) {
    const double there = std::min(1.0, share + next);
    if (depth_after(there) > most) {
      next /= 2;
    } else {
      share = there;
    }
  }
  return {std::max(share, std::min(1.0, least)), true};
}

double mean_depth(const Contact& contact) {
  double area = 0;
  for (std::size_t i = 0; i < contact.count; ++i) area += contact.patches[i].area;
  return area > 0 ? contact.whole.volume / area : 0;
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
  const double sag = settings.depth * size;  // [u] by default
  const double pull = lighter.gravity > 0 ? lighter.gravity : sag / (step * step);
  Spring spring;
  spring.stiffness = settings.law.stiffness > 0 ? settings.law.stiffness : meeting.stiffness();
  spring.linear = std::numeric_limits<double>::infinity();
  spring.rebound = std::exp(-2 * settings.damping);
  spring.step = step;
  if (!std::isfinite(lighter.mass)) return spring;  // nothing moves
  if (!(spring.stiffness > 0)) {
    spring.linear = sag;
    spring.stiffness = stiffness_for_depth(lighter.mass * pull, face, sag);
  }
  const double held = spring.stiffness * face / lighter.mass;  // [1/s²]
  spring.rest = lighter.gravity > 0 ? lighter.gravity / held : sag;
  spring.slow = std::sqrt(2 * held) * spring.rest;
  spring.relaxation = 2 * settings.damping / std::sqrt(held);
  // A stiff spring must separate bodies no more slowly.
  const double fall = std::sqrt(2 * pull * std::max(spring.rest, sag));
  spring.push_out = settings.push_out > 0 ? settings.push_out : 3 * fall;
  spring.least = std::min(fall, spring.push_out);
  return spring;
}

}  // namespace ist::bullet
