// Thousands of balls: instances of three spheres, finer ones for larger balls.

import * as THREE from 'three';

const kShapes = [
  {atLeast: 0.12, geometry: new THREE.IcosahedronGeometry(1, 9)},
  {atLeast: 0.03, geometry: new THREE.IcosahedronGeometry(1, 4)},
  {atLeast: 0, geometry: new THREE.IcosahedronGeometry(1, 1)},
];

/** Instanced meshes of x, y, z, radius each; `size` is that of the whole. */
export function balls(data, size, material) {
  const ways = kShapes.map(() => []);
  for (let i = 0; i < data.length; i += 4) {
    ways[kShapes.findIndex(({atLeast}) => data[i + 3] >= atLeast * size)].push(i);
  }
  const matrix = new THREE.Matrix4(), shade = new THREE.Color();
  return ways.flatMap((places, k) => {
    if (places.length === 0) return [];
    const mesh = new THREE.InstancedMesh(kShapes[k].geometry, material, places.length);
    places.forEach((i, n) => {
      const r = data[i + 3];
      mesh.setMatrixAt(n, matrix.makeScale(r, r, r).setPosition(data[i], data[i + 1], data[i + 2]));
    });
    // Different shades distinguish touching balls.
    places.forEach(
        (i, n) => mesh.setColorAt(n, shade.setScalar(0.8 + 0.36 * ((0.618034 * n) % 1))));
    mesh.frustumCulled = false;
    return [mesh];
  });
}
