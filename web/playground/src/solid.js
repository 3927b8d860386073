// A drawn solid: its asset's mesh, its spheres at a level of detail, or a level of its tree.

import * as THREE from 'three';
import {toCreasedNormals} from 'three/addons/utils/BufferGeometryUtils.js';

import {balls} from './balls.js';
import {Columns} from './columns.js';

/**
 * Fills cuts: inner sides, which only a cut shows, are painted flat, and those of balls at the depth
 * of the plane. Where balls overlap, the one with the larger chord is visible.
 */
function fillCuts(shader) {
  shader.vertexShader = 'varying vec4 vBall;\n' +
      shader.vertexShader.replace('#include <project_vertex>', `#include <project_vertex>
      vBall = vec4(0.0);
      #ifdef USE_INSTANCING
        vBall = vec4((modelViewMatrix * vec4(instanceMatrix[3].xyz, 1.0)).xyz, length(instanceMatrix[0].xyz));
      #endif`);
  shader.fragmentShader = 'varying vec4 vBall;\nuniform mat4 projectionMatrix;\n' +
      shader.fragmentShader.replace('#include <opaque_fragment>', `#include <opaque_fragment>
      #if NUM_CLIPPING_PLANES > 0
        // Edges of triangles may pass the plane by their samples.
        if (vBall.w > 0.0 && dot(-vBall.xyz, clippingPlanes[0].xyz) - vBall.w > clippingPlanes[0].w) discard;
        gl_FragDepth = gl_FragCoord.z;
        if (!gl_FrontFacing) {
          gl_FragColor.rgb = 0.68 * diffuseColor.rgb;
          vec3 seen = -vClipPosition;
          vec3 cut = -clippingPlanes[0].w / dot(seen, clippingPlanes[0].xyz) * seen;
          vec3 off = cut - vBall.xyz;
          float room = vBall.w * vBall.w - dot(off, off);
          if (room > 0.0) {
            vec4 onPlane = projectionMatrix * vec4(cut, 1.0);
            gl_FragColor.rgb *= 0.78 + 0.22 * smoothstep(0.0, 0.16, room / (vBall.w * vBall.w));
            gl_FragDepth = 0.5 + 0.5 * onPlane.z / onPlane.w - 1e-3 * sqrt(room) / length(cut);
          }
        }
      #endif`);
}

/** [rad] Edges sharper than this are drawn as edges. */
const kCrease = 0.6;

export class Solid {
  /**
   * `order`: solids of a higher one are drawn over transparent ones of a lower. `like`: a solid of
   * the same asset, whose surface it shares.
   */
  constructor(asset, colour, order, like) {
    this.asset = asset;
    this.surface = like?.surface ?? {};
    this.info = asset.info();
    this.bounds = asset.bounds();
    this.order = order;
    this.opacity = 1;
    this.group = new THREE.Group();
    this.material =
        new THREE.MeshStandardMaterial({color: colour, roughness: 0.55, metalness: 0.05});
    this.material.side = THREE.DoubleSide;
    this.material.onBeforeCompile = fillCuts;
    this.depth =
        new THREE.MeshBasicMaterial({colorWrite: false, transparent: true, side: THREE.DoubleSide});
    this.depth.onBeforeCompile = fillCuts;
    this.show('surface', 0);
  }

  /** Sphere counts of the levels that a mode has. */
  levels(mode) {
    if (mode === 'spheres') return this.info.details;
    if (mode === 'surface') return [];
    this.treeSizes ??=
        Array.from({length: this.asset.levelCount()}, (_, k) => this.asset.level(k).length / 4);
    return this.treeSizes;
  }

  show(mode, level) {
    this.asked = {mode, level};
    if (mode === 'surface' && this.info.meshTriangles === 0) mode = 'spheres';
    const last = Math.max(0, this.levels(mode).length - 1);
    this.shown = {mode, level: Math.min(level, last)};
    this.draw();
  }

  setOpacity(opacity) {
    this.opacity = opacity;
    this.material.opacity = opacity;
    this.material.transparent = opacity < 1;
    // Only what lies in front is seen of a transparent B: its depth is drawn first. What A holds is
    // to be seen through A.
    this.material.depthWrite = opacity === 1;
    this.material.needsUpdate = true;
    this.layer();
  }

  setCut(planes) {
    for (const material of [this.material, this.depth]) {
      material.clippingPlanes = planes;
      material.needsUpdate = true;
    }
  }

  dispose() {
    this.clear();
    this.surface.geometry?.dispose();
    this.surface.columns?.dispose();
    this.material.dispose();
    this.depth.dispose();
    this.group.removeFromParent();
  }

  // --- Contents of the group

  mesh() {
    if (this.surface.geometry) return this.surface.geometry;
    const {positions, triangles} = this.asset.mesh();
    const shared = new THREE.BufferGeometry();
    shared.setAttribute('position', new THREE.BufferAttribute(new Float32Array(positions), 3));
    shared.setIndex(new THREE.BufferAttribute(triangles, 1));
    this.surface.geometry = toCreasedNormals(shared, kCrease);
    shared.dispose();
    return this.surface.geometry;
  }

  /** Textures by which a shader finds inside points. */
  columns() {
    return this.surface.columns ??= new Columns(this.mesh().getAttribute('position').array);
  }

  draw() {
    const {mode, level} = this.shown, {asset} = this;
    this.clear();
    this.parts = mode === 'surface' ?
        [new THREE.Mesh(this.mesh(), this.material)] :
        balls(
            mode === 'spheres' ? asset.spheres({detail: level}) : asset.level(level),
            this.bounds.radius, this.material);
    this.group.add(...this.parts);
    this.layer();
  }

  layer() {
    for (const part of this.depths ?? []) part.removeFromParent();
    this.depths = [];
    const visible = this.opacity > 0;
    for (const part of this.parts) {
      part.visible = visible;
      part.renderOrder = 2 * this.order;
      if (!visible || this.opacity === 1 || this.order === 0) continue;
      const depth = part.isInstancedMesh ? new THREE.InstancedMesh(part.geometry, this.depth, 0) :
                                           new THREE.Mesh(part.geometry, this.depth);
      if (part.isInstancedMesh) {
        depth.instanceMatrix = part.instanceMatrix;
        depth.count = part.count;
        depth.frustumCulled = false;
      }
      depth.renderOrder = 2 * this.order - 1;
      this.depths.push(depth);
      this.group.add(depth);
    }
  }

  clear() {
    for (const part of [...(this.parts ?? []), ...(this.depths ?? [])]) {
      part.removeFromParent();
      if (part.isInstancedMesh && !this.depths.includes(part)) part.dispose();
    }
    this.parts = this.depths = [];
  }
}
