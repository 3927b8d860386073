#pragma once

#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>

#include "ist_collision_algorithm.h"

/// Every pair of the world that an IstCollisionAlgorithm answers for.
template <class Visit>
void for_each_ist_pair(btDynamicsWorld& world, const Visit& visit) {
  btBroadphasePairArray& pairs = world.getPairCache()->getOverlappingPairArray();
  for (int i = 0; i < pairs.size(); ++i) {
    auto* const algorithm = dynamic_cast<IstCollisionAlgorithm*>(pairs[i].m_algorithm);
    if (algorithm == nullptr) continue;
    visit(*algorithm, *static_cast<btCollisionObject*>(pairs[i].m_pProxy0->m_clientObject),
          *static_cast<btCollisionObject*>(pairs[i].m_pProxy1->m_clientObject));
  }
}

/// Has the law's forces applied before every substep of the world: IstSettings::Response::wrench.
///
/// Boxes that begin to overlap in a step are known to it from the next on. Takes the world's tick
/// callback before the step.
inline void push_in_every_tick(btDynamicsWorld& world) {
  world.setInternalTickCallback(
      [](btDynamicsWorld* stepped, btScalar step) {
        for_each_ist_pair(
            *stepped, [step](IstCollisionAlgorithm& pair, const btCollisionObject& first,
                             const btCollisionObject& second) { pair.push(first, second, step); });
      },
      world.getWorldUserInfo(), true);
}
