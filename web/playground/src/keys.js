// B, or the part in hand, by keys, while the view has the focus.

import * as THREE from 'three';

const kLeastStep = 1 / 512, kMostStep = 1 / 4;  // of B's radius

export class Keys {
  /** `world()` returns right, up and near [unit], and B's radius; `act` contains the keys' actions. */
  constructor(holder, world, act) {
    this.world = world;
    this.act = act;
    this.step = 1 / 32;
    holder.addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || !act.ready()) return;
      if (this.pressed(event)) event.preventDefault();
    });
  }

  pressed({key, shiftKey}) {
    const {right, up, near, radius} = this.world();
    const along = {
      ArrowLeft: [right, -1],
      ArrowRight: [right, 1],
      ArrowUp: [up, 1],
      ArrowDown: [up, -1],
      PageUp: [near, -1],
      PageDown: [near, 1],
    }[key];
    if (along) {
      const [axis, sign] = along;
      if (shiftKey) {
        this.act.turn(new THREE.Quaternion().setFromAxisAngle(axis, 2 * sign * this.step));
      } else {
        this.act.move(axis.clone().multiplyScalar(sign * this.step * radius));
      }
      return true;
    }
    const act = {
      '[': () => this.resize(0.5),
      ']': () => this.resize(2),
      'm': () => this.act.handles('translate'),
      't': () => this.act.handles('rotate'),
      ' ': this.act.letGo,
      'Home': this.act.home,
      'r': this.act.read,
      'n': () => this.act.next(shiftKey ? -1 : 1),
    }[key.length === 1 ? key.toLowerCase() : key];
    act?.();
    return act !== undefined;
  }

  resize(factor) {
    this.step = Math.min(kMostStep, Math.max(kLeastStep, this.step * factor));
    this.act.say(`Steps of ${+ (100 * this.step).toPrecision(2)} % of B's radius.`);
  }
}
