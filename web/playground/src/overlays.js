// A contact drawn over the solids: force and torque, patches, the overlap, the gap.

import * as THREE from 'three';

import {kMostPatches} from './contact.js';
import {Overlap, paint} from './overlap.js';

const kUp = new THREE.Vector3(0, 1, 0), kForward = new THREE.Vector3(0, 0, 1);
const kTurn = 1.6 * Math.PI;  // [rad] of the arc that shows a torque

/** A scene of its own, which is drawn last, over everything. */
export class Top {
  constructor() {
    this.light = new THREE.DirectionalLight(0xffffff, 1.3);
    this.scene = new THREE.Scene().add(
        new THREE.HemisphereLight(0xffffff, 0xa0a8b0, 1.8), this.light, this.light.target);
  }
}

export class Overlays extends Top {
  constructor() {
    super();
    this.materials = {force: paint(), torque: paint(), patch: paint(), gap: paint()};
    const {force, torque, patch, gap} = this.materials;
    patch.side = THREE.DoubleSide;
    this.shown = {arrows: true, patches: false, overlap: true, gap: true};

    this.shaft =
        new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 20).translate(0, 0.5, 0), force);
    this.head = new THREE.Mesh(new THREE.ConeGeometry(1, 1, 28).translate(0, 0.5, 0), force);
    this.arc = new THREE.Mesh(new THREE.TorusGeometry(1, 0.05, 12, 64, kTurn), torque);
    this.arcHead = new THREE.Mesh(new THREE.ConeGeometry(0.13, 0.36, 24), torque);
    this.arcHead.position.set(Math.cos(kTurn), Math.sin(kTurn), 0);
    this.arcHead.rotation.z = kTurn;
    this.turn = new THREE.Group().add(this.arc, this.arcHead);
    this.discs =
        new THREE.InstancedMesh(new THREE.CylinderGeometry(1, 1, 0.12, 40), patch, kMostPatches);
    this.overlap = new Overlap();
    this.bridge = new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 12).translate(0, 0.5, 0), gap);
    this.ends = [0, 1].map(() => new THREE.Mesh(new THREE.SphereGeometry(1, 20, 14), gap));
    this.discs.frustumCulled = false;
    this.scene.add(
        this.shaft, this.head, this.turn, this.discs, this.overlap.group, this.bridge, ...this.ends);
    this.scene.visible = false;  // until update() gave everything its size
  }

  setColours(colours) {
    for (const [name, material] of Object.entries(this.materials)) paint(colours[name], material);
    this.overlap.recolour();
  }

  /** Draws a contact; `size` [u] is that of the smaller solid; `a` and `b` contain the solids. */
  update({best, separation, patches, outline}, size, a, b) {
    const touching = best.volume > 0;
    this.scene.visible = true;
    this.drawForce(touching && this.shown.arrows, best, size);
    this.drawTorque(touching && this.shown.arrows, best, size, b.position);
    this.discs.count = touching && this.shown.patches ? patches.count : 0;
    for (let i = 0; i < this.discs.count; ++i) {
      const {centroid, normal, area} = patches.patches[i];
      const r = Math.sqrt(area / Math.PI);
      turn.setFromUnitVectors(kUp, at.fromArray(normal).lengthSq() > 0 ? at : kUp);
      this.discs.setMatrixAt(
          i,
          matrix.compose(
              at.fromArray(centroid), turn, scale.set(r, Math.max(r, 0.02 * size) * 0.4, r)));
    }
    this.discs.instanceMatrix.needsUpdate = true;
    this.overlap.group.visible = touching && this.shown.overlap;
    if (this.overlap.group.visible) this.overlap.update([a, b], outline);
    this.drawGap(!touching && this.shown.gap, separation, size);
  }

  // --- Below: one thing each

  drawForce(visible, {force, centroid}, size) {
    const strength = Math.hypot(...force);
    this.shaft.visible = this.head.visible = visible && strength > 0;
    if (!this.shaft.visible) return;
    const length = size * grown(strength / size ** 2), head = Math.min(0.16 * size, 0.45 * length);
    const direction = at.fromArray(force).divideScalar(strength);
    this.shaft.quaternion.setFromUnitVectors(kUp, direction);
    this.head.quaternion.copy(this.shaft.quaternion);
    this.shaft.position.fromArray(centroid);
    this.head.position.fromArray(centroid).addScaledVector(direction, length - head);
    this.shaft.scale.set(0.022 * size, length - head, 0.022 * size);
    this.head.scale.set(0.06 * size, head, 0.06 * size);
  }

  drawTorque(visible, {torque}, size, origin) {
    const strength = Math.hypot(...torque);
    this.turn.visible = visible && strength > 1e-9 * size ** 3;
    if (!this.turn.visible) return;
    this.turn.position.copy(origin);
    this.turn.quaternion.setFromUnitVectors(kForward, at.fromArray(torque).divideScalar(strength));
    this.turn.scale.setScalar(0.15 * size + 0.45 * size * grown(strength / size ** 3));
  }

  drawGap(visible, {distance, pointA, pointB}, size) {
    const shown = visible && distance > 0;
    for (const mesh of [this.bridge, ...this.ends]) mesh.visible = shown;
    if (!shown) return;
    at.fromArray(pointB).sub(scale.fromArray(pointA));
    const length = at.length();
    this.bridge.position.fromArray(pointA);
    this.bridge.quaternion.setFromUnitVectors(kUp, at.divideScalar(length));
    this.bridge.scale.set(0.008 * size, length, 0.008 * size);
    this.ends.forEach((end, k) => {
      end.position.fromArray(k ? pointB : pointA);
      end.scale.setScalar(0.022 * size);
    });
  }
}

/** A length from a magnitude: visible for small ones, and never off the screen. */
const grown = (x) => 0.9 * (1 - Math.exp(-2 * Math.sqrt(x)));

const matrix = new THREE.Matrix4(), turn = new THREE.Quaternion();
const at = new THREE.Vector3(), scale = new THREE.Vector3();
