// Many parts, any of which a visitor takes in hand, and the pairs that meet: a Scene of ist-query.

import {Scene} from 'ist-query';
import * as THREE from 'three';

import {kTimedOften, meanTime} from './contact.js';
import {Hand, poseOf} from './hand.js';
import {Overlap} from './overlap.js';
import {Top} from './overlays.js';
import {Solid} from './solid.js';
import {colour} from './theme.js';

/** [u] Nearer parts are listed too, so that a pair that barely touches does not come and go. */
const kMargin = 0.05;

export class Tray extends Hand {
  /**
   * `on`: callbacks after a query of the scene (`asked`), after a step was timed (`timed`), after a
   * visitor moved a part (`moved`), and after one was taken in hand (`taken`).
   */
  constructor(view, on) {
    super(view, on);
    this.overlays = new Top();
    this.solids = [];
    this.assets = {};
    this.pairs = new Map();  // that meet, by their numbers
    this.up = 'z';
  }

  /**
   * Takes `assets` by name, which it frees when others come, and parts {solid: an asset's name,
   * pose, scale}.
   */
  hold(assets, parts) {
    for (const solid of this.solids) solid.dispose();
    for (const {overlap} of this.pairs.values()) overlap?.group.removeFromParent();
    this.scene?.free();
    for (const asset of Object.values(this.assets)) asset.free();
    this.assets = assets;
    this.pairs.clear();
    this.scene = new Scene({maxBodies: parts.length});
    this.scene.setRule(0, 0, {measure: 'exact', margin: kMargin});
    const first = {}, counts = {};
    this.solids = parts.map(({solid: name, pose, scale = 1}, i) => {
      const solid = new Solid(assets[name], colour('a'), 0, first[name]);
      first[name] ??= solid;
      counts[name] = (counts[name] ?? 0) + 1;
      solid.name = `${name} ${counts[name]}`;
      solid.radius = scale * solid.bounds.radius;
      solid.home = pose;
      solid.group.scale.setScalar(scale);
      solid.number = this.scene.add(assets[name], {...pose, scale}, {number: i + 1});
      this.view.scene.add(solid.group);
      return solid;
    });
    this.b = this.solids[0];
    this.reset();
  }

  reset() {
    for (const solid of this.solids) {
      this.setPose(solid.home, solid);
      this.place(solid);
    }
  }

  place({number, group}) {
    this.scene.setPoses([number], [poseOf(group)]);
  }

  touched() {
    this.place(this.b);
    super.touched();
  }

  setVisible(visible) {
    super.setVisible(visible);
    this.view.setHandles({lift: visible});
  }

  /** The part that a ray meets, and where. */
  pick({origin, direction}) {
    const {number, point} = this.scene.raycast(origin.toArray(), direction.toArray());
    return number[0] ? {solid: this.solids[number[0] - 1], at: new THREE.Vector3(...point)} :
                       undefined;
  }

  /** Takes a part in hand. */
  take(solid) {
    this.b = solid;
    this.view.handles.attach(solid.group);
    this.touched();
    this.on.taken(solid);
  }

  next(by) {
    const count = this.solids.length;
    this.take(this.solids[(this.solids.indexOf(this.b) + by + count) % count]);
  }

  /** Largest first; those that ended too, until they are dropped from `pairs`. */
  ranked() {
    return [...this.pairs.values()].sort(
        (p, q) => q.rank - p.rank || p.a.number - q.a.number || p.b.number - q.b.number);
  }

  // --- A frame

  /** Queries if anything moved, and updates the drawing. */
  update() {
    if (!this.stale) {
      if (this.timed < kTimedOften) this.time();
      return;
    }
    this.stale = false;
    this.timed = 0;
    this.ask(performance.now());
    this.draw();
    this.on.asked(this);
  }

  ask(now) {
    const {pairs, solids} = this, step = this.step = this.scene.step({into: this.step});
    for (const {a, b, begins, penetration, separation} of step.pairs.slice(0, step.count)) {
      const key = `${a} ${b}`;
      const pair = pairs.get(key) ?? {a: solids[a - 1], b: solids[b - 1], rank: 0};
      pairs.set(key, pair);
      const {volume, force} = penetration;
      Object.assign(pair, {volume, force: Math.hypot(...force), gap: separation.distance});
      if (begins) pair.began = now;
      pair.rank = volume || 0;
      pair.ended = undefined;
    }
    for (let i = 0; i < step.endedCount; ++i) {
      const pair = pairs.get(`${step.ended[2 * i]} ${step.ended[2 * i + 1]}`);
      Object.assign(pair, {volume: 0, ended: now});
    }
  }

  /** Takes the least time of a step in which the part in hand has moved, a little each frame. */
  time() {
    const mean = meanTime(() => {
      this.place(this.b);
      this.scene.step({into: this.step});
    });
    this.stepTime = Math.min(this.timed++ === 0 ? Infinity : this.stepTime, mean);
    if (this.timed === kTimedOften) this.on.timed(this);
  }

  /** Draws overlaps, and how much of each part overlaps, without jumps as they vanish. */
  draw() {
    for (const solid of this.solids) solid.mark = 0;
    for (const pair of this.pairs.values()) {
      const {a, b, volume} = pair;
      if (volume > 0 && !pair.overlap) {
        pair.overlap = new Overlap();
        pair.overlap.hold(a, b);
        pair.overlap.recolour();
        this.overlays.scene.add(pair.overlap.group);
      }
      if (pair.overlap) pair.overlap.group.visible = volume > 0;
      if (!(volume > 0)) continue;
      const size = Math.cbrt(volume) / Math.min(a.radius, b.radius);
      pair.overlap.update([a.group, b.group]);
      pair.overlap.setOpacity(1 - Math.exp(-50 * size));
      for (const solid of [a, b])
        solid.mark = Math.max(solid.mark, 0.6 * (1 - Math.exp(-8 * size)));
    }
    const overlap = new THREE.Color(colour('overlap'));
    for (const solid of this.solids) {
      solid.material.color.set(colour(solid === this.b ? 'b' : 'a')).lerp(overlap, solid.mark);
    }
  }

  recolour() {
    super.recolour();
    if (!this.scene) return;
    for (const {overlap} of this.pairs.values()) overlap?.recolour();
    this.draw();
  }
}
