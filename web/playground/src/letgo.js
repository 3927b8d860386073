// B as a free body of density 1: gravity, and a pressure that grows with the depth of each patch.
//
// The law is that of <ist/contact_law.h>: springs per area with Hunt and Crossley's damping, and
// Coulomb's friction that holds by springs until it slides. Steps are small and semi-implicit.

import {contactPatches, Shape, overlap} from 'ist-query';
import * as THREE from 'three';

import {poseOf} from './hand.js';

const kStep = 1 / 960;  // [s]
const kBudget = 10;     // [ms] of a frame; beyond it time goes slower
const kGravity = 8;     // [B's radii/s²]
const kFastest = 14;    // [B's radii/s] keeps B from jumping through A in a step
const kDepth = 0.01;    // [B's radii] how deep B rests on kArea of its squared radius
const kArea = 0.2;
const kFriction = 0.35;  // by default
const kDrag = 0.15;      // [1/s] of air
const kRollingDrag = 6;  // [1/s] of turns, times friction, while B touches
const kCalmFor = 0.75;   // [s] B rests once it moved less than kCalm for so long
const kCalm = 2e-2;      // [B's radii/s]
const kPatches = 12;

export class LetGo {
  /** `up`: unit; the floor lies at `floor` [u] along it. */
  constructor(a, b, {up, floor, friction = kFriction}) {
    this.a = a;
    this.b = b;
    this.up = up.clone();
    this.ground = Shape.halfSpace(up.toArray(), floor);
    this.radius = b.bounds().radius;
    const {volume, centreOfMass, inertia} = b.massProperties();
    this.mass = volume;
    this.centre = new THREE.Vector3().fromArray(centreOfMass);
    this.inverseInertia = new THREE.Matrix3().fromArray(inertia).invert();
    this.gravity = kGravity * this.radius;
    this.stiffness = this.mass * this.gravity / (kArea * kDepth * this.radius ** 3);
    const impact = Math.sqrt(2 * this.gravity * this.radius);
    this.damping = 1.5 / impact;  // comes back at about a fifth of the speed
    this.frictionStiffness = this.stiffness / 4;
    this.frictionDamping =
        0.2 * this.frictionStiffness / Math.sqrt(this.stiffness * this.radius ** 2 / this.mass);
    this.friction = friction;
    this.velocity = new THREE.Vector3();
    this.spin = new THREE.Vector3();  // angular momentum
    this.contacts = [a, this.ground].map(
        (solid) => ({solid, options: {maxPatches: kPatches}, memory: new Map()}));
    this.still();
  }

  /** Stops all motion, like a hand. */
  still() {
    this.velocity.set(0, 0, 0);
    this.spin.set(0, 0, 0);
    this.calm = this.owed = 0;
    for (const contact of this.contacts) contact.memory.clear();
  }

  get resting() {
    return this.calm >= kCalmFor;
  }

  /** Advances B (an Object3D) by a frame's time [s]; returns true if it moved. */
  advance(body, seconds) {
    if (this.resting) return false;
    this.owed = Math.min(this.owed + seconds, 1 / 20);
    const start = performance.now();
    for (; this.owed >= kStep; this.owed -= kStep) {
      if (performance.now() - start > kBudget)
        this.owed = 0;
      else
        this.step(body);
    }
    return true;
  }

  step(body) {
    rotation.setFromMatrix4(matrix.makeRotationFromQuaternion(body.quaternion));
    world.copy(this.inverseInertia)
        .premultiply(rotation)
        .multiply(inverse.copy(rotation).transpose());
    angular.copy(this.spin).applyMatrix3(world);
    arm.copy(this.centre).applyMatrix3(rotation);
    centre.copy(body.position).add(arm);

    // Pushes are about B's origin first, then about its centre of mass.
    force.set(0, 0, 0);
    torque.set(0, 0, 0);
    origin.copy(this.velocity).sub(sideways.copy(angular).cross(arm));
    for (const contact of this.contacts) this.push(contact, body);
    torque.sub(sideways.copy(arm).cross(force));
    force.addScaledVector(this.up, -this.mass * this.gravity);

    this.velocity.addScaledVector(force, kStep / this.mass).multiplyScalar(1 - kDrag * kStep);
    const touching = this.contacts.some(({memory}) => memory.size > 0);
    this.spin.addScaledVector(torque, kStep)
        .multiplyScalar(1 - (kDrag + (touching ? kRollingDrag * this.friction : 0)) * kStep);
    this.velocity.clampLength(0, kFastest * this.radius);
    angular.copy(this.spin).applyMatrix3(world);
    const turning = angular.length();
    if (turning > kFastest) {
      this.spin.multiplyScalar(kFastest / turning);
      angular.multiplyScalar(kFastest / turning);
    }
    centre.addScaledVector(this.velocity, kStep);
    if (turning > 0) {
      const angle = angular.length() * kStep;
      body.quaternion.premultiply(turn.setFromAxisAngle(angular.normalize(), angle)).normalize();
    }
    body.position.copy(centre).sub(arm.copy(this.centre).applyQuaternion(body.quaternion));

    const moves = this.velocity.length() / this.radius + turning;
    this.calm = moves < kCalm ? this.calm + kStep : 0;
  }

  /** Adds one solid's action on B to force and torque about B's origin. */
  push(contact, body) {
    const {solid, options, memory} = contact;
    if (overlap(solid, this.b, poseOf(body, pose)) === 'no') {
      memory.clear();
      return;
    }
    const found = options.into = contactPatches(solid, this.b, pose, options);
    const seen = contact.seen ??= new Set();
    seen.clear();
    for (let i = 0; i < found.count; ++i) {
      const patch = found.patches[i];
      seen.add(patch.id);
      let kept = memory.get(patch.id);
      if (!kept) memory.set(patch.id, kept = {area: 0, stretch: new THREE.Vector3()});
      if (patch.area > kept.area) {
        kept.stretch.multiplyScalar(Math.sqrt(kept.area / patch.area));
        kept.area = patch.area;
      }
      if (!(kept.area > 0)) continue;
      along.fromArray(patch.force);
      about.fromArray(patch.torque);
      const rate = -(along.dot(origin) + about.dot(angular)) / kept.area;
      const pressure =
          this.stiffness * patch.volume / kept.area * Math.max(0, 1 + this.damping * rate);
      force.addScaledVector(along, pressure);
      torque.addScaledVector(about, pressure);

      normal.fromArray(patch.normal);
      reach.fromArray(patch.centroid).sub(body.position);
      sideways.copy(angular).cross(reach).add(origin);
      sideways.addScaledVector(normal, -normal.dot(sideways));
      kept.stretch.addScaledVector(normal, -normal.dot(kept.stretch))
          .addScaledVector(sideways, kStep);
      const limit = this.friction * pressure * patch.area,
            spring = this.frictionStiffness * kept.area;
      const held = spring * kept.stretch.length();
      if (held > limit) kept.stretch.multiplyScalar(limit / held);
      along.copy(kept.stretch)
          .multiplyScalar(-spring)
          .addScaledVector(sideways, -this.frictionDamping * kept.area)
          .clampLength(0, limit);
      force.add(along);
      torque.add(reach.cross(along));
    }
    for (const id of memory.keys())
      if (!seen.has(id)) memory.delete(id);
  }

  free() {
    this.ground.free();
  }
}

const pose = {
  rotation: [1, 0, 0, 0],
  translation: [0, 0, 0]
};
const matrix = new THREE.Matrix4(), rotation = new THREE.Matrix3(), inverse = new THREE.Matrix3();
const world = new THREE.Matrix3(), turn = new THREE.Quaternion();
const force = new THREE.Vector3(), torque = new THREE.Vector3(), angular = new THREE.Vector3();
const arm = new THREE.Vector3(), centre = new THREE.Vector3(), origin = new THREE.Vector3();
const along = new THREE.Vector3(), about = new THREE.Vector3(), normal = new THREE.Vector3();
const reach = new THREE.Vector3(), sideways = new THREE.Vector3();
