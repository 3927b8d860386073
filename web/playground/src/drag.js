// A part under the mouse or a finger, dragged along the floor.

import * as THREE from 'three';

const kGrazing = 0.15;  // of the floor's normal: below that the part goes up and down

export class Drag {
  /**
   * `act.ready()`: whether there is anything; `act.pick(ray)`: the point of a part that a ray
   * meets, if it does; `act.take()`: takes that part in hand; `act.move(by)` moves it.
   */
  constructor(view, act) {
    this.view = view;
    const {holder} = view;
    // After the canvas's own: its handles come first, and it captured the pointer.
    holder.addEventListener('pointerdown', (event) => {
      if (!act.ready() || !event.isPrimary || event.button !== 0 || view.handles.dragging) return;
      const ray = this.ray(event), at = act.pick(ray);
      if (!at) return;
      act.take();
      const along = Math.abs(ray.direction.dot(view.up)) > kGrazing ? view.up : view.near;
      this.plane = new THREE.Plane().setFromNormalAndCoplanarPoint(along, at);
      this.at = at;
      view.orbit.enabled = false;
    });
    holder.addEventListener('pointermove', (event) => {
      if (!event.isPrimary) return;
      if (!this.at) {
        if (event.buttons === 0)
          holder.style.cursor = act.ready() && act.pick(this.ray(event)) ? 'grab' : '';
        return;
      }
      const at = this.ray(event).intersectPlane(this.plane, new THREE.Vector3());
      if (!at) return;
      act.move(at.clone().sub(this.at));
      this.at = at;
    });
    for (const end of ['pointerup', 'pointercancel'])
      holder.addEventListener(end, ({isPrimary}) => {
        if (!isPrimary || !this.at) return;
        this.at = undefined;
        view.orbit.enabled = true;
      });
  }

  ray({clientX, clientY}) {
    const {left, top, width, height} = this.view.canvas.getBoundingClientRect();
    const place =
        new THREE.Vector2(2 * (clientX - left) / width - 1, 1 - 2 * (clientY - top) / height);
    const caster = new THREE.Raycaster();
    caster.setFromCamera(place, this.view.camera);
    return caster.ray;
  }
}
