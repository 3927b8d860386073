#!/usr/bin/env bash
# libccd 2.1 (Debian 12): ccdGJKPenetration() tells depth 0 for boxes of side 2 that are 0.1 aside along their diagonal, where 1.9 is
# true, and for a ball that is 0.1 deep in the middle of a box's side; it returns success. ccdMPRPenetration() tells 3.29 and 0.1.
# Aside along one axis alone, or along three axes by other amounts, the first is right.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
chmod 755 .
apt-get download -qq libccd-dev=2.1-2+b1 libccd2=2.1-2+b1 2>/dev/null
for package in *.deb; do dpkg -x "$package" ccd; done
cat >depths.c <<'END'
#include <assert.h>
#include <ccd/ccd.h>
#include <math.h>
#include <stdio.h>

typedef struct {
  double centre[3], half, radius;
} Solid;  // a cube, or a ball if half is 0

static void support(const void* object, const ccd_vec3_t* direction, ccd_vec3_t* out) {
  const Solid* s = object;
  const double* d = direction->v;
  const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  for (int k = 0; k < 3; ++k) out->v[k] = s->centre[k] + (d[k] < 0 ? -s->half : s->half) + s->radius * d[k] / length;
}
static void centre(const void* object, ccd_vec3_t* out) {
  for (int k = 0; k < 3; ++k) out->v[k] = ((const Solid*)object)->centre[k];
}

static double depth(const Solid* a, const Solid* b, int by_mpr) {
  ccd_t ccd;
  ccd_real_t depth = -1;
  ccd_vec3_t direction, position;
  CCD_INIT(&ccd);
  ccd.support1 = ccd.support2 = support;
  ccd.center1 = ccd.center2 = centre;
  ccd.max_iterations = 1000;
  assert((by_mpr ? ccdMPRPenetration : ccdGJKPenetration)(a, b, &ccd, &depth, &direction, &position) == 0);
  return depth;
}

int main(void) {
  const Solid cube = {{0, 0, 0}, 1, 0};
  const struct {
    const char* text;
    Solid other;
    double truth, gjk, mpr;
  } rows[] = {{"cubes 0.1 0 0 aside", {{0.1, 0, 0}, 1, 0}, 1.9, 1.9, 1.9},
              {"cubes 0.1 0.2 0.3 aside", {{0.1, 0.2, 0.3}, 1, 0}, 1.7, 1.7, -1},
              {"cubes 0.1 0.1 0.1 aside", {{0.1, 0.1, 0.1}, 1, 0}, 1.9, 0, 1.9 * sqrt(3)},
              {"a ball at 1.9 0 0", {{1.9, 0, 0}, 0, 1}, 0.1, 0, 0.1},
              {"a ball at 1.9 0.3 0.2", {{1.9, 0.3, 0.2}, 0, 1}, 0.1, 0.098, 0.1}};
  for (int i = 0; i < 5; ++i) {
    const double gjk = depth(&cube, &rows[i].other, 0), mpr = depth(&cube, &rows[i].other, 1);
    printf("%s: true %.3f, ccdGJKPenetration %.3f, ccdMPRPenetration %.3f\n", rows[i].text, rows[i].truth, gjk, mpr);
    assert(fabs(gjk - rows[i].gjk) < 1e-3 && (rows[i].mpr < 0 || fabs(mpr - rows[i].mpr) < 1e-3));
  }
  return 0;
}
END
libraries=$folder/ccd/usr/lib/$(gcc -print-multiarch)
gcc -Iccd/usr/include depths.c -o depths "$libraries/libccd.so.2" -lm
LD_LIBRARY_PATH=$libraries ./depths
