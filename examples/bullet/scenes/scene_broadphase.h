#pragma once

#include <btBulletCollisionCommon.h>

#include <ist/scene.h>
#include <memory>
#include <vector>

/// ist::Scene as the broad phase of a world of Bullet's whose bodies are ist::bullet::Shapes among
/// shapes of Bullet's that are held still: two of these never meet.
class SceneBroadphase : public btBroadphaseInterface {
 public:
  /// `most`: bodies.
  explicit SceneBroadphase(std::size_t most);

  btBroadphaseProxy* createProxy(const btVector3& lower, const btVector3& upper, int shape,
                                 void* object, int group, int mask, btDispatcher*) override;
  void destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override;
  void setAabb(btBroadphaseProxy* proxy, const btVector3& lower, const btVector3& upper,
               btDispatcher*) override;
  void getAabb(btBroadphaseProxy* proxy, btVector3& lower, btVector3& upper) const override;
  void rayTest(const btVector3& from, const btVector3& to, btBroadphaseRayCallback& found,
               const btVector3& lower, const btVector3& upper) override;
  void aabbTest(const btVector3& lower, const btVector3& upper,
                btBroadphaseAabbCallback& found) override;
  void calculateOverlappingPairs(btDispatcher* dispatcher) override;
  btOverlappingPairCache* getOverlappingPairCache() override { return &pairs_; }
  const btOverlappingPairCache* getOverlappingPairCache() const override { return &pairs_; }
  void getBroadphaseAabb(btVector3& lower, btVector3& upper) const override;
  void printStats() override {}

 private:
  ist::Scene scene_;
  std::vector<std::unique_ptr<btBroadphaseProxy>> proxies_;  ///< by number
  btHashedOverlappingPairCache pairs_;
};
