#include "scene_broadphase.h"

#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <ist/bullet/convert.h>
#include <ist/bullet/shape.h>

#include <stdexcept>

using ist::bullet::to_eigen;
using ist::bullet::to_pose;

namespace {

const btCollisionObject& object_of(const btBroadphaseProxy& proxy) {
  return *static_cast<const btCollisionObject*>(proxy.m_clientObject);
}

/// Where the asset's or the shape's own frame is.
ist::Pose pose_of(const btCollisionObject& object) {
  const auto* const part = dynamic_cast<const ist::bullet::Shape*>(object.getCollisionShape());
  const btTransform& body = object.getWorldTransform();
  return to_pose(part != nullptr ? body * part->mesh_in_body() : body);
}

/// A shape of Bullet's is its plane, or the box around it. Throws for one that moves.
ist::PlacedSolid solid_of(const btCollisionObject& object, const btVector3& lower,
                          const btVector3& upper) {
  const btCollisionShape* const shape = object.getCollisionShape();
  if (const auto* const part = dynamic_cast<const ist::bullet::Shape*>(shape))
    return {part->tree(), pose_of(object), part->scale()};
  if (!object.isStaticObject())
    throw std::invalid_argument("SceneBroadphase: a body that moves must be an ist::bullet::Shape");
  if (const auto* const plane = dynamic_cast<const btStaticPlaneShape*>(shape))
    return {ist::HalfSpaceShape{to_eigen(plane->getPlaneNormal()), plane->getPlaneConstant()},
            pose_of(object)};
  const Eigen::Vector3d middle = to_eigen((lower + upper) / 2);
  return {ist::BoxShape{to_eigen((upper - lower) / 2)},
          ist::Pose{{1, 0, 0, 0}, {middle.x(), middle.y(), middle.z()}}};
}

}  // namespace

SceneBroadphase::SceneBroadphase(std::size_t most)
    : scene_({.max_bodies = most, .max_pairs = 32 * most, .patches_per_pair = 1}) {
  scene_.set_rule(0, 0, {.answer = ist::SceneAnswer::boxes});
}

btBroadphaseProxy* SceneBroadphase::createProxy(const btVector3& lower, const btVector3& upper, int,
                                                void* object, int group, int mask, btDispatcher*) {
  const auto number = static_cast<std::uint32_t>(proxies_.size());
  proxies_.push_back(std::make_unique<btBroadphaseProxy>(lower, upper, object, group, mask));
  btBroadphaseProxy& proxy = *proxies_.back();
  proxy.m_uniqueId = static_cast<int>(number);
  scene_.add({.number = number,
              .solid = solid_of(object_of(proxy), lower, upper),
              .moves = !object_of(proxy).isStaticObject()});
  return &proxy;
}

void SceneBroadphase::destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) {
  pairs_.removeOverlappingPairsContainingProxy(proxy, dispatcher);
  scene_.remove(static_cast<std::uint32_t>(proxy->m_uniqueId));
  proxies_[static_cast<std::size_t>(proxy->m_uniqueId)].reset();
}

void SceneBroadphase::setAabb(btBroadphaseProxy* proxy, const btVector3& lower,
                              const btVector3& upper, btDispatcher*) {
  proxy->m_aabbMin = lower;
  proxy->m_aabbMax = upper;
  if (!object_of(*proxy).isStaticObject())
    scene_.set_pose(static_cast<std::uint32_t>(proxy->m_uniqueId), pose_of(object_of(*proxy)));
}

void SceneBroadphase::getAabb(btBroadphaseProxy* proxy, btVector3& lower, btVector3& upper) const {
  lower = proxy->m_aabbMin;
  upper = proxy->m_aabbMax;
}

void SceneBroadphase::rayTest(const btVector3& from, const btVector3& to,
                              btBroadphaseRayCallback& found, const btVector3& lower,
                              const btVector3& upper) {
  btVector3 low = from, high = from;
  low.setMin(to);
  high.setMax(to);
  aabbTest(low + lower, high + upper, found);
}

void SceneBroadphase::aabbTest(const btVector3& lower, const btVector3& upper,
                               btBroadphaseAabbCallback& found) {
  std::vector<std::uint32_t> numbers(scene_.size());
  numbers.resize(scene_.in_box(to_eigen(lower), to_eigen(upper), numbers));
  for (const std::uint32_t number : numbers) found.process(proxies_[number].get());
}

void SceneBroadphase::calculateOverlappingPairs(btDispatcher* dispatcher) {
  const ist::SceneStep step = scene_.step();
  if (step.pairs_exceeded) throw std::runtime_error("SceneBroadphase: too many pairs");
  for (const ist::ScenePair& pair : step.pairs)
    if (pair.event == ist::SceneEvent::begins)
      pairs_.addOverlappingPair(proxies_[pair.a].get(), proxies_[pair.b].get());
  for (const ist::ScenePairName& pair : step.ended)
    if (proxies_[pair.a] && proxies_[pair.b])
      pairs_.removeOverlappingPair(proxies_[pair.a].get(), proxies_[pair.b].get(), dispatcher);
}

void SceneBroadphase::getBroadphaseAabb(btVector3& lower, btVector3& upper) const {
  lower.setValue(-BT_LARGE_FLOAT, -BT_LARGE_FLOAT, -BT_LARGE_FLOAT);
  upper = -lower;
}
