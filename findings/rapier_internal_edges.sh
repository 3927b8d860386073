#!/usr/bin/env bash
# Rapier's flag FIX_INTERNAL_EDGES, by the package @dimforge/rapier3d-compat 0.21.0: a cube that just touches a fixed cube made of
# triangles, face on face, is told to be 1 deep in it, its whole width, and is thrown off with a spin, without gravity or speed.
# Without the flag, with cuboids, or with a gap of a thousandth, it stays where it is.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund @dimforge/rapier3d-compat@0.21.0 >/dev/null
cat >run.mjs <<'END'
import assert from 'node:assert';
import RAPIER from '@dimforge/rapier3d-compat';
await RAPIER.init();
const corners = [], faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
for (const x of [-0.5, 0.5]) for (const y of [-0.5, 0.5]) for (const z of [-0.5, 0.5]) corners.push(x, y, z);
const triangles = faces.flatMap(([a, b, c, d]) => [a, b, c, a, c, d]);
const mesh = (flags) => RAPIER.ColliderDesc.trimesh(new Float32Array(corners), new Uint32Array(triangles), flags);
const cuboid = () => RAPIER.ColliderDesc.cuboid(0.5, 0.5, 0.5);

function rest(shape, gap) {
  const world = new RAPIER.World({x: 0, y: 0, z: 0});
  const wall = world.createCollider(shape, world.createRigidBody(RAPIER.RigidBodyDesc.fixed()));
  const body = world.createRigidBody(RAPIER.RigidBodyDesc.dynamic().setTranslation(1 + gap, 0, 0));
  const cube = world.createCollider(cuboid(), body);
  let deepest = 0, fastest = 0;
  for (let step = 0; step < 120; ++step) {
    world.step();
    if (step === 0) {
      world.contactPair(wall, cube, (manifold) => {
        for (let i = 0; i < manifold.numContacts(); ++i) deepest = Math.max(deepest, -manifold.contactDist(i));
      });
    }
    const {x, y, z} = body.linvel();
    fastest = Math.max(fastest, Math.hypot(x, y, z));
  }
  return {deepest, fastest};
}

const fixed = RAPIER.TriMeshFlags.FIX_INTERNAL_EDGES;
for (const [name, shape, gap] of [
  ['cuboid', cuboid, 0], ['triangles', () => mesh(), 0], ['triangles with the flag', () => mesh(fixed), 0],
  ['triangles with the flag', () => mesh(fixed), 0.001]]) {
  const {deepest, fastest} = rest(shape(), gap);
  console.log(`${name}, gap ${gap}: ${deepest.toFixed(3)} deep at first, then ${fastest.toFixed(3)} m/s`);
  const thrown = name.includes('flag') && gap === 0;
  assert(thrown ? deepest > 0.9 && fastest > 0.3 : deepest < 1e-3 && fastest < 1e-3);
}
END
node run.mjs
