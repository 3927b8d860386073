#!/usr/bin/env bash
# Bullet 3.24 (Debian 12): contactPairTest() and contactTest() report nothing of two btGImpactMeshShape that overlap, in any pose, though
# the same world's own detection makes four contacts of them. Those of two cubes of side 2 that are 0.1 deep are 1.7 or 1.9 deep, and
# push along the face instead of apart. Of a mesh and a box both functions report what is there.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
chmod 755 .
version=3.24+dfsg-2
apt-get download -qq {libbullet-dev,libbullet3.24}="$version" 2>/dev/null
for package in *.deb; do dpkg -x "$package" bullet; done
cat >cubes.cpp <<'END'
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <btBulletCollisionCommon.h>
#include <cassert>
#include <cmath>
#include <cstdio>

btGImpactMeshShape* mesh() {
  auto* triangles = new btTriangleMesh;
  const int corners[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                              {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  const auto place = [](int i) { return btVector3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1); };
  for (const auto& t : corners) triangles->addTriangle(place(t[0]), place(t[1]), place(t[2]));
  auto* shape = new btGImpactMeshShape(triangles);
  shape->setMargin(0);
  shape->updateBound();
  return shape;
}

struct Count : btCollisionWorld::ContactResultCallback {
  int count = 0;
  btScalar addSingleResult(btManifoldPoint&, const btCollisionObjectWrapper*, int, int, const btCollisionObjectWrapper*, int,
                           int) override {
    ++count;
    return 0;
  }
};

int main() {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher);
  btDbvtBroadphase broadphase;
  btCollisionWorld world(&dispatcher, &broadphase, &configuration);
  for (const btVector3& at : {btVector3(1.9, 0.3, 0.2), btVector3(1.9, 0, 0)}) {
    for (const bool box : {false, true}) {
      btCollisionObject a, b;
      a.setCollisionShape(mesh());
      b.setCollisionShape(box ? static_cast<btCollisionShape*>(new btBoxShape(btVector3(1, 1, 1))) : mesh());
      b.setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
      world.addCollisionObject(&a);
      world.addCollisionObject(&b);
      world.performDiscreteCollisionDetection();
      int contacts = 0;
      double deepest = 0, along = 0;
      for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
        const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
        for (int k = 0; k < manifold.getNumContacts(); ++k, ++contacts) {
          if (-manifold.getContactPoint(k).getDistance() <= deepest) continue;
          deepest = -manifold.getContactPoint(k).getDistance();
          along = std::fabs(manifold.getContactPoint(k).m_normalWorldOnB.x());
        }
      }
      Count pair, one;
      world.contactPairTest(&a, &b, pair);
      world.contactTest(&a, one);
      world.removeCollisionObject(&a);
      world.removeCollisionObject(&b);
      std::printf("mesh and %s, 0.1 deep, %.1f aside: the world has %d contacts, %.2f deep (share of the right direction %.2f);"
                  " contactPairTest() reports %d, contactTest() %d\n",
                  box ? "box" : "mesh", at.y(), contacts, deepest, along, pair.count, one.count);
      assert(contacts > 0);
      if (box) {
        assert(pair.count > 0 && one.count > 0 && std::fabs(deepest - 0.1) < 1e-3 && along > 0.99);
      } else {
        assert(pair.count == 0 && one.count == 0 && deepest > 1.6 && along < 0.01);
      }
    }
  }
}
END
libraries=$folder/bullet/usr/lib/$(gcc -print-multiarch)
g++ -O1 -w -Ibullet/usr/include/bullet cubes.cpp -o cubes "$libraries"/libBulletCollision.so.3.24 "$libraries"/libLinearMath.so.3.24
LD_LIBRARY_PATH=$libraries ./cubes
