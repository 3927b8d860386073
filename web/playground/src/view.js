// The canvas: camera, lights, floor, the plane that cuts, and B's handles.

import * as THREE from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {TransformControls} from 'three/addons/controls/TransformControls.js';

export class View {
  constructor(holder) {
    this.holder = holder;
    try {
      this.renderer = new THREE.WebGLRenderer({antialias: true});
    } catch {
      throw new Error(
          'This browser shows no WebGL, which the page draws with: switch it on, or try another.');
    }
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.localClippingEnabled = true;
    this.renderer.autoClear = false;
    this.canvas = this.renderer.domElement;
    holder.append(this.canvas);

    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.01, 100);
    this.ambient = new THREE.HemisphereLight(0xffffff, 0x8a93a0, 1.7);
    this.key = new THREE.DirectionalLight(0xffffff, 2.4);
    this.rim = new THREE.DirectionalLight(0xcfe0ff, 0.9);
    this.lights = new THREE.Group().add(this.key, this.key.target, this.rim, this.rim.target);
    this.scene.add(this.ambient, this.lights);
    this.cut = new THREE.Plane();
    this.dirty = true;

    this.orbit = new OrbitControls(this.camera, this.canvas);
    this.orbit.enableDamping = false;
    this.orbit.addEventListener('change', () => this.dirty = true);
    this.handles = new TransformControls(this.camera, this.canvas);
    this.handles.setSpace('world');
    this.handles.addEventListener('change', () => this.dirty = true);
    this.handles.addEventListener('dragging-changed', ({value}) => this.orbit.enabled = !value);
    this.handles.setSize(1.25);
    // In a scene of their own, drawn last: nothing hides them.
    this.top = new THREE.Scene().add(this.handles.getHelper());

    new ResizeObserver(() => this.resize()).observe(holder);
    this.resize();
  }

  /** Places the camera to show a whole ball; `up` is 'y' or 'z'. */
  frame(centre, radius, up) {
    this.up = new THREE.Vector3(0, up === 'y' ? 1 : 0, up === 'z' ? 1 : 0);
    // Towards the eye, along the floor.
    this.near = up === 'y' ? new THREE.Vector3(0, 0, 1) : new THREE.Vector3(0, -1, 0);
    this.right = new THREE.Vector3(1, 0, 0);
    this.radius = radius;
    this.camera.up.copy(this.up);
    this.ambient.position.copy(this.up);
    const eye = this.near.clone().addScaledVector(this.up, 0.42).addScaledVector(this.right, 0.38);
    const half = Math.tan(this.camera.fov * Math.PI / 360) * Math.min(1, this.camera.aspect);
    this.camera.position.copy(centre).addScaledVector(
        eye.normalize(), 1.06 * radius / Math.sin(Math.atan(half)));
    this.camera.near = radius / 50;
    this.camera.far = radius * 60;
    this.camera.updateProjectionMatrix();
    // The orbit's axis is the camera's up when it was made.
    this.orbit.dispose();
    const {target} = this.orbit;
    this.orbit = new OrbitControls(this.camera, this.canvas);
    this.orbit.addEventListener('change', () => this.dirty = true);
    this.orbit.target.copy(target.copy(centre));
    this.orbit.maxDistance = 12 * radius;
    this.orbit.minDistance = 0.2 * radius;
    this.orbit.update();
    this.dirty = true;
  }

  /** A grid to fall on, at a height [u] along up, for solids of a radius. */
  setFloor(height, radius) {
    this.floor?.removeFromParent();
    this.floor?.geometry.dispose();
    this.floor?.material.dispose();
    this.floor = new THREE.GridHelper(6 * radius, 24, 0xffffff, 0xffffff);
    this.floor.material.transparent = true;
    this.floor.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), this.up);
    this.floor.position.copy(this.up).multiplyScalar(height);
    this.scene.add(this.floor);
  }

  /** `mode`: 'translate' or 'rotate'; `lift`: they move up and down alone. */
  setHandles({mode = this.handles.mode, lift = this.lift}) {
    this.lift = lift;
    this.handles.setMode(mode);
    this.handles.showX = this.handles.showY = !lift || mode === 'rotate';
  }

  /** `handle`: of all three axes, none of which then looks like a force or an overlap. */
  setColours({ground, line, handle, held}) {
    this.renderer.setClearColor(ground);
    this.handles.setColors(handle, handle, handle, held);
    this.floor?.material.color.set(line);
    this.dirty = true;
  }

  /** Cuts away the nearer part of a box, up to a share of its depth; returns the planes. */
  setCut(share, centre, radius) {
    if (share === 0) return [];
    this.cut.normal.copy(this.near).negate();
    this.cut.constant = -this.cut.normal.dot(centre) - radius * (2 * share - 1);
    return [this.cut];
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.holder;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  /** Draws, if anything changed; `over` is drawn over everything. */
  render(over) {
    if (!this.dirty) return;
    this.dirty = false;
    this.place(this.key, -0.45, 0.7, 1);
    this.place(this.rim, 0.9, 0.35, -0.4);
    if (over) {
      over.light.position.copy(this.key.position);
      over.light.target.position.copy(this.orbit.target);
      over.light.target.updateMatrixWorld();
    }
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
    if (!over) return;
    for (const scene of [over.scene, this.top]) {
      this.renderer.clearDepth();
      this.renderer.render(scene, this.camera);
    }
  }

  /** A light that goes with the camera, so that no side is dark: right, up, towards the eye. */
  place(light, right, up, near) {
    light.target.position.copy(this.orbit.target);
    light.position.set(right, up, near)
        .applyQuaternion(this.camera.quaternion)
        .multiplyScalar(10 * (this.radius ?? 1))
        .add(this.orbit.target);
  }
}
