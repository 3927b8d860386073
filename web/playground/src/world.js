// The two solids, B's place, and their contact: everything except the page around it.

import * as THREE from 'three';

import {Contact} from './contact.js';
import {Hand, poseOf} from './hand.js';
import {LetGo} from './letgo.js';
import {Overlays} from './overlays.js';
import {Solid} from './solid.js';
import {colour} from './theme.js';

export class World extends Hand {
  /**
   * `on`: callbacks after a query of a contact (`asked`), after it was timed (`timed`), after a
   * visitor moved B (`moved`), and after B was let go or held (`held`).
   */
  constructor(view, on) {
    super(view, on);
    this.overlays = new Overlays();
    this.pose = {rotation: [1, 0, 0, 0], translation: [0, 0, 0]};
    this.home = {rotation: [1, 0, 0, 0], translation: [0, 0, 0]};
    this.settings = {mode: 'surface', level: 0, opacityA: 1, opacityB: 0.45, cut: 0};
    view.handles.addEventListener('dragging-changed', () => this.still());
  }

  get solids() {
    return [this.a, this.b].filter(Boolean);
  }

  /**
   * Takes two assets, which it frees when others come. `up`: 'y' or 'z'; `friction` once let go.
   */
  hold(assetA, assetB, {pose, up = 'z', friction}) {
    const own = new Set([assetA, assetB]);
    this.letGo(false);
    for (const solid of this.solids) {
      solid.dispose();
      if (!own.has(solid.asset)) solid.asset.free();
    }
    this.a = new Solid(assetA, colour('a'), 0);
    this.b = new Solid(assetB, colour('b'), 1);
    this.contact = new Contact(assetA, assetB);
    this.overlays.overlap.hold(this.a, this.b);
    this.view.scene.add(this.a.group, this.b.group);
    this.view.handles.attach(this.b.group);
    this.home = pose;
    this.up = up;
    this.friction = friction;
    this.size = Math.min(this.a.bounds.radius, this.b.bounds.radius);
    this.show();
    this.reset();
    this.frame();
  }

  frame() {
    super.frame();
    this.show();
  }

  swap() {
    const at = this.b.group.matrixWorld.clone().invert();
    const translation = new THREE.Vector3(), turned = new THREE.Quaternion();
    at.decompose(translation, turned, new THREE.Vector3());
    const {x, y, z, w} = turned;
    this.hold(this.b.asset, this.a.asset, {
      pose: {rotation: [w, x, y, z], translation: translation.toArray()},
      up: this.up,
      friction: this.friction,
    });
  }

  // --- Where B stands

  reset() {
    this.still();
    this.setPose(this.home);
  }

  still() {
    this.free?.still();
  }

  /** Lets B fall, or takes it in hand again. */
  letGo(free) {
    if (free === (this.free !== undefined)) return;
    this.free?.free();
    this.free = free ? new LetGo(
                           this.a.asset, this.b.asset,
                           {up: this.view.up, floor: this.floor, friction: this.friction}) :
                       undefined;
    this.on.held(free);
  }

  // --- What is drawn

  /** Applies changed settings; `levels()` then returns the solids' number of levels. */
  show(changed = {}) {
    Object.assign(this.settings, changed);
    if (!this.a) return;
    const {mode, level, opacityA, opacityB, cut} = this.settings;
    for (const [solid, opacity] of [[this.a, opacityA], [this.b, opacityB]]) {
      if (solid.asked.mode !== mode || solid.asked.level !== level) solid.show(mode, level);
      if (solid.opacity !== opacity) solid.setOpacity(opacity);
      if (this.view.near) {
        const centre = new THREE.Vector3().fromArray(this.a.bounds.centre);
        solid.setCut(this.view.setCut(cut, centre, this.a.bounds.radius));
      }
    }
    this.touched();
  }

  levels() {
    const {mode} = this.settings;
    const [a, b] = [this.a, this.b].map((solid) => solid.levels(mode));
    return Array.from(
        {length: Math.max(a.length, b.length)},
        (_, k) =>
            [a[Math.min(k, a.length - 1)],
             b[Math.min(k, b.length - 1)],
    ]);
  }

  recolour() {
    super.recolour();
    for (const name of ['a', 'b']) this[name]?.material.color.set(colour(name));
    this.overlays.setColours({
      force: colour('force'),
      torque: colour('torque'),
      patch: colour('patch'),
      gap: colour('soft'),
    });
  }

  // --- A frame

  /** Moves free bodies, queries if anything moved, and updates the scene. */
  update(seconds) {
    if (!this.a) return;
    const {group} = this.b;
    if (this.free && !this.view.handles.dragging && this.free.advance(group, seconds)) {
      this.stale = this.view.dirty = true;
    }
    if (!this.stale) {
      if (this.contact.time(this.pose)) this.on.timed(this.contact);
      return;
    }
    this.stale = false;
    this.contact.ask(poseOf(group, this.pose), this.overlays.shown);
    this.overlays.update(this.contact, this.size, this.a.group, group);
    this.on.asked(this.contact);
  }
}
