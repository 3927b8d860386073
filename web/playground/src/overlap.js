// The exact overlap of two solids: the surface of each inside the other, and the outline on which
// the surfaces cross.

import * as THREE from 'three';
import {LineMaterial} from 'three/addons/lines/LineMaterial.js';
import {LineSegments2} from 'three/addons/lines/LineSegments2.js';
import {LineSegmentsGeometry} from 'three/addons/lines/LineSegmentsGeometry.js';

import {kIsInside} from './columns.js';
import {colour} from './theme.js';

const kLineWidth = 1.5;  // [px]
/** Share of a solid's radius: surface points are tested this far below, so that flush faces do not flicker. */
const kBelow = 1e-4;

export class Overlap {
  constructor() {
    this.group = new THREE.Group();
    this.line = new LineMaterial({linewidth: kLineWidth});
    this.outline = new LineSegments2(new LineSegmentsGeometry(), this.line);
    this.capacity = 0;  // [segments]
    this.skins = ['overlap', 'overlap-b'].map((name) => {
      const material = paint(), uniforms = {lists: {}, corners: {}, side: {}, below: {}, toColumns: {value: new THREE.Matrix4()}};
      material.onBeforeCompile = (shader) => drawInside(shader, uniforms);
      // Behind the outline, which lies on it.
      Object.assign(material, {polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 4});
      return {name, uniforms, mesh: new THREE.Mesh(undefined, material)};
    });
    for (const part of [this.outline, ...this.skins.map(({mesh}) => mesh)]) {
      part.frustumCulled = false;
      this.group.add(part);
    }
  }

  /** Sets the two solids; nothing is drawn if one has no mesh. */
  hold(a, b) {
    const drawn = a.info.meshTriangles > 0 && b.info.meshTriangles > 0;
    [[a, b], [b, a]].forEach(([own, other], k) => {
      const skin = this.skins[k], {mesh, uniforms} = skin;
      mesh.visible = drawn;
      if (!drawn) return;
      const columns = skin.columns = other.columns();
      mesh.geometry = own.mesh();
      uniforms.lists.value = columns.lists;
      uniforms.corners.value = columns.corners;
      uniforms.side.value = columns.side;
      uniforms.below.value = kBelow * own.bounds.radius;
    });
  }

  /** `groups` of A and B; `outline` is of overlapOutline(), or undefined. */
  update(groups, outline) {
    for (const group of groups) group.updateMatrixWorld();
    this.skins.forEach(({mesh, uniforms, columns}, k) => {
      if (!mesh.visible) return;
      uniforms.toColumns.value.copy(groups[1 - k].matrixWorld).invert().premultiply(columns.toGrid);
      groups[k].matrixWorld.decompose(mesh.position, mesh.quaternion, mesh.scale);
    });
    this.drawOutline(outline);
  }

  setOpacity(opacity) {
    for (const {mesh} of this.skins) Object.assign(mesh.material, {transparent: true, opacity});
  }

  recolour() {
    for (const {name, mesh} of this.skins) paint(colour(name), mesh.material);
    this.line.color.set(colour('outline'));
  }

  drawOutline(outline) {
    const {geometry} = this.outline, count = outline?.count ?? 0;
    this.outline.visible = count > 0;
    if (count === 0) return;
    if (count > this.capacity) {
      this.capacity = 2 * count;
      geometry.dispose();
      geometry.setPositions(new Float32Array(6 * this.capacity));
    }
    const {data} = geometry.getAttribute('instanceStart');
    data.array.set(outline.segments.subarray(0, 6 * count));
    data.needsUpdate = true;
    geometry.instanceCount = count;
  }
}

/** A material that is drawn over the solids. */
export function paint(colour = 0xffffff, material = new THREE.MeshStandardMaterial({roughness: 0.6})) {
  material.color.set(colour);
  material.emissive.set(colour).multiplyScalar(0.3);
  return material;
}

/** Draws only the part of a surface inside the columns' solid. */
function drawInside(shader, uniforms) {
  Object.assign(shader.uniforms, uniforms);
  shader.vertexShader = 'uniform mat4 toColumns;\nuniform float below;\nvarying vec3 vInColumns;\n' +
      shader.vertexShader.replace('#include <project_vertex>', `#include <project_vertex>
      vInColumns = (toColumns * modelMatrix * vec4(transformed - below * normal, 1.0)).xyz;`);
  shader.fragmentShader = `varying vec3 vInColumns;\n${kIsInside}` +
      shader.fragmentShader.replace('void main() {', `void main() {
      if (!isInside(vInColumns)) discard;`);
}
