#!/usr/bin/env bash
# Open Dynamics Engine 0.16.2 (Debian's libode): two cubes of side 2, both triangle meshes, that touch face on face have contacts 2
# deep, along a diagonal of the faces; at 0.1 deep they are the same. With a box for one of the meshes depth and direction are right.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
chmod 755 .
apt-get download -qq libode-dev=2:0.16.2-1 libode8=2:0.16.2-1 2>/dev/null
for package in *.deb; do dpkg -x "$package" ode; done
cat >cubes.c <<'END'
#include <assert.h>
#include <math.h>
#include <ode/ode.h>
#include <stdio.h>

static float corners[24];
static const unsigned triangles[36] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                       2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};

static dGeomID mesh(void) {
  dTriMeshDataID data = dGeomTriMeshDataCreate();
  dGeomTriMeshDataBuildSingle(data, corners, 12, 8, triangles, 36, 12);
  return dCreateTriMesh(0, data, 0, 0, 0);
}

static dContactGeom deepest(dGeomID a, dGeomID b, double x) {
  dContactGeom contacts[64];
  dGeomSetPosition(b, x, 0, 0);
  int count = dCollide(a, b, 64, contacts, sizeof contacts[0]), best = 0;
  assert(count > 0);
  for (int i = 1; i < count; ++i) {
    if (contacts[i].depth > contacts[best].depth) best = i;
  }
  return contacts[best];
}

int main(void) {
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  for (int i = 0; i < 24; ++i) corners[i] = (i / 3) >> (i % 3) & 1 ? 1 : -1;
  const double places[] = {2.0, 1.9};
  for (int i = 0; i < 2; ++i) {
    const dContactGeom meshes = deepest(mesh(), mesh(), places[i]);
    const dContactGeom box = deepest(mesh(), dCreateBox(0, 2, 2, 2), places[i]);
    printf("%.1f deep: two meshes %.3f deep, direction %.2f %.2f %.2f; mesh and box %.3f, %.2f %.2f %.2f\n", 2 - places[i],
           meshes.depth, meshes.normal[0], meshes.normal[1], meshes.normal[2], box.depth, box.normal[0], box.normal[1], box.normal[2]);
    assert(fabs(meshes.depth - 2) < 1e-3 && fabs(meshes.normal[0]) < 1e-3);
    assert(fabs(box.depth - (2 - places[i])) < 1e-3 && fabs(fabs(box.normal[0]) - 1) < 1e-3);
  }
  return 0;
}
END
libraries=$folder/ode/usr/lib/$(gcc -print-multiarch)
gcc -Iode/usr/include cubes.c -o cubes "$libraries/libode.so.8" -lm
LD_LIBRARY_PATH=$libraries ./cubes
