// The overlap of two solids as it is: the surface of each inside the other, and the outline on which
// the surfaces cross.

import * as THREE from 'three';
import {LineMaterial} from 'three/addons/lines/LineMaterial.js';
import {LineSegments2} from 'three/addons/lines/LineSegments2.js';
import {LineSegmentsGeometry} from 'three/addons/lines/LineSegmentsGeometry.js';

import {Columns, kIsInside} from './columns.js';

const kLineWidth = 1.5;  // [px]

export class Overlap {
  /** `materials`: of A's surface and of B's. */
  constructor(materials) {
    this.group = new THREE.Group();
    this.line = new LineMaterial({linewidth: kLineWidth});
    this.outline = new LineSegments2(new LineSegmentsGeometry(), this.line);
    this.capacity = 0;  // [segments]
    this.skins = materials.map((material) => {
      const uniforms = {lists: {}, corners: {}, side: {}, toColumns: {value: new THREE.Matrix4()}};
      material.onBeforeCompile = (shader) => drawInside(shader, uniforms);
      // Behind the outline, which lies on it.
      Object.assign(material, {polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 4});
      return {uniforms, mesh: new THREE.Mesh(undefined, material)};
    });
    for (const part of [this.outline, ...this.skins.map(({mesh}) => mesh)]) {
      part.frustumCulled = false;
      this.group.add(part);
    }
  }

  /** Takes two solids; nothing is drawn where one holds no mesh. */
  hold(a, b) {
    for (const {columns} of this.skins) columns?.dispose();
    const drawn = a.info.meshTriangles > 0 && b.info.meshTriangles > 0;
    [[a, b], [b, a]].forEach(([own, other], k) => {
      const skin = this.skins[k], {mesh, uniforms} = skin;
      skin.columns = undefined;
      mesh.visible = drawn;
      if (!drawn) return;
      const columns = skin.columns = new Columns(other.mesh().getAttribute('position').array);
      mesh.geometry = own.mesh();
      uniforms.lists.value = columns.lists;
      uniforms.corners.value = columns.corners;
      uniforms.side.value = columns.side;
    });
  }

  /** `b` is B's matrix, A's is the identity; `outline` is of overlapOutline(), or undefined. */
  update(b, outline) {
    const [{mesh, uniforms, columns}, ofB] = this.skins;
    if (mesh.visible) {
      uniforms.toColumns.value.copy(b).invert().premultiply(columns.toGrid);
      ofB.uniforms.toColumns.value.copy(ofB.columns.toGrid);
      b.decompose(ofB.mesh.position, ofB.mesh.quaternion, ofB.mesh.scale);
    }
    this.drawOutline(outline);
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

/** Leaves of a surface what lies in the columns' solid. */
function drawInside(shader, uniforms) {
  Object.assign(shader.uniforms, uniforms);
  shader.vertexShader = 'uniform mat4 toColumns;\nvarying vec3 vInColumns;\n' +
      shader.vertexShader.replace('#include <project_vertex>', `#include <project_vertex>
      vInColumns = (toColumns * modelMatrix * vec4(transformed, 1.0)).xyz;`);
  shader.fragmentShader = `varying vec3 vInColumns;\n${kIsInside}` +
      shader.fragmentShader.replace('void main() {', `void main() {
      if (!isInside(vInColumns)) discard;`);
}
