// Plays an animated scene, as the examples for engines write them.

import * as THREE from 'three';

export class Player {
  /** The form with its button, slider and output; `facts`: a list for a scene's properties. */
  constructor({form, play, moment, told, facts, leave}, onLeave) {
    Object.assign(this, {form, play, moment, told, facts});
    play.onclick = () => this.setPlaying(!this.playing);
    moment.oninput = () => {
      this.setPlaying(false);
      this.seek(Number(moment.value) * this.duration);
    };
    leave.onclick = onLeave;
    form.onsubmit = () => false;
  }

  /** Adds a scene to `into`; returns its ball and its up axis, which glTF changes. */
  start({name, scene, animations}, into) {
    this.stop();
    this.scene = scene;
    let bodies = 0;
    const moving =
        new Set(animations.flatMap(({tracks}) => tracks.map((track) => track.name.split('.')[0])));
    scene.traverse((part) => {
      if (!part.isMesh) return;
      ++bodies;
      part.frustumCulled = false;
      // Plain default materials get different colours, so that bodies can be distinguished.
      if (!part.material.map && part.material.color?.getHex() === 0xffffff) {
        part.material = new THREE.MeshStandardMaterial(
            {color: bodyColour(this.count++), roughness: 0.55, metalness: 0.05});
      }
    });
    into.add(scene);
    this.mixer = new THREE.AnimationMixer(scene);
    for (const clip of animations) this.mixer.clipAction(clip).play();
    this.duration = Math.max(...animations.map((clip) => clip.duration), 1e-3);
    this.form.hidden = false;
    this.tellFacts([
      ['Scene', name],
      ['Bodies', String(bodies)],
      ['Moving', String(moving.size)],
      ['Length', `${this.duration.toFixed(2)} s`],
    ]);
    this.setPlaying(!matchMedia('(prefers-reduced-motion: reduce)').matches);
    this.seek(0);
    const ball = new THREE.Box3().setFromObject(scene).getBoundingSphere(new THREE.Sphere());
    return {centre: ball.center, radius: ball.radius};
  }

  tellFacts(rows) {
    this.facts.replaceChildren(...rows.flatMap(
        ([name, value]) =>
            [Object.assign(document.createElement('dt'), {textContent: name}),
             Object.assign(document.createElement('dd'), {textContent: value}),
    ]));
  }

  stop() {
    this.scene?.removeFromParent();
    this.scene = this.mixer = undefined;
    this.count = 0;
    this.form.hidden = true;
  }

  setPlaying(playing) {
    this.playing = playing;
    this.play.textContent = playing ? 'Pause' : 'Play';
    this.moved = true;
  }

  seek(time) {
    this.time = time;
    this.mixer.setTime(time);
    this.moment.value = time / this.duration;
    this.told.textContent = `${time.toFixed(2)} s`;
    this.moment.setAttribute('aria-valuetext', this.told.textContent);
    this.moved = true;
  }

  /** Advances by a frame's time [s]; returns true if the scene changed. */
  advance(seconds) {
    if (this.playing) this.seek((this.time + seconds) % this.duration);
    const {moved} = this;
    this.moved = false;
    return moved;
  }
}

/** Colours far from each other, one after the other. */
const bodyColour = (i) => new THREE.Color().setHSL((0.58 + 0.381966 * i) % 1, 0.45, 0.5);
