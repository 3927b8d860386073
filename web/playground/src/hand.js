// Solids, one of which, B, is in a visitor's hand: its motion, and the camera.

import * as THREE from 'three';

import {colour} from './theme.js';

export class Hand {
  /** `on.moved`: what to call when a visitor moved B. */
  constructor(view, on) {
    this.view = view;
    this.on = on;
    view.handles.addEventListener('objectChange', () => {
      if (view.handles.object === this.b?.group) this.moved();
    });
  }

  /** Shows or hides the solids. */
  setVisible(visible) {
    for (const {group} of this.solids) group.visible = visible;
    if (visible)
      this.view.handles.attach(this.b.group);
    else
      this.view.handles.detach();
  }

  setPose({rotation: [w, x, y, z], translation}, {group} = this.b) {
    group.quaternion.set(x, y, z, w).normalize();
    group.position.fromArray(translation);
    this.touched();
  }

  move(by) {
    this.b.group.position.add(by);
    this.moved();
  }

  /** About the middle of B. */
  turn(by) {
    const {position, quaternion, scale} = this.b.group;
    const middle = new THREE.Vector3().fromArray(this.b.bounds.centre).multiply(scale);
    position.add(middle.clone().applyQuaternion(quaternion));
    quaternion.premultiply(by).normalize();
    position.sub(middle.applyQuaternion(quaternion));
    this.moved();
  }

  moved() {
    this.on.moved();
    this.still();
    this.touched();
  }

  /** Stops B's own motion. */
  still() {}

  touched() {
    this.stale = true;
    this.view.dirty = true;
  }

  /** Places the camera to show all solids, on a floor below. */
  frame() {
    const box = new THREE.Box3();
    for (const {bounds, group} of this.solids) {
      group.updateMatrixWorld(true);
      box.union(ofBounds(bounds).applyMatrix4(group.matrixWorld));
    }
    const whole = box.getBoundingSphere(new THREE.Sphere());
    this.view.frame(whole.center, Math.max(0.86 * whole.radius, this.b.bounds.radius), this.up);
    this.floor = box.min.getComponent(this.up === 'y' ? 1 : 2) - 0.02 * whole.radius;
    this.view.setFloor(this.floor, whole.radius);
    this.recolour();
  }

  recolour() {
    this.view.setColours({
      ground: colour('ground'),
      line: colour('line'),
      handle: colour('ink'),
      held: colour('accent'),
    });
  }
}

/** The pose of an Object3D for queries. */
export function poseOf({position, quaternion: {x, y, z, w}}, into = {
  rotation: [],
  translation: []
}) {
  Object.assign(into.rotation, [w, x, y, z]);
  position.toArray(into.translation);
  return into;
}

const ofBounds = ({lower, upper}) =>
    new THREE.Box3(new THREE.Vector3().fromArray(lower), new THREE.Vector3().fromArray(upper));
