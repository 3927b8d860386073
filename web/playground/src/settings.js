// The panel's settings: how solids are drawn, and how B is moved.

import {$} from './dom.js';
import {whole} from './format.js';

const chosen = (name) => document.querySelector(`input[name=${name}]:checked`).value;

export class Settings {
  constructor(world, view) {
    this.world = world;
    this.view = view;
    $('mode').onchange = () => this.setMode(chosen('mode'));
    $('level').oninput = () => {
      world.show({level: Number($('level').value)});
      this.tellLevels();
    };
    for (const which of ['a', 'b']) {
      const slider = $(`opacity-${which}`);
      slider.oninput = () => {
        $(`opacity-${which}-told`).textContent = `${slider.value} %`;
        world.show({[`opacity${which.toUpperCase()}`]: slider.value / 100});
      };
    }
    $('cut').oninput = () => this.setCut(Number($('cut').value) / 100);
    $('overlays').onchange = ({target}) => {
      world.overlays.shown[target.value] = target.checked;
      this.tellLegend();
      world.touched();
    };
    $('gizmo').onchange = () => this.setHandles(chosen('gizmo'));
    this.tellLegend();
  }

  /** 'surface', 'spheres' or 'tree', from the finest level on. */
  setMode(mode) {
    document.querySelector(`input[name=mode][value=${mode}]`).checked = true;
    this.world.show({mode, level: 0});
    this.tellLevels();
  }

  /** `share`: of the depth of A, from the eye. */
  setCut(share) {
    $('cut').value = 100 * share;
    $('cut-told').textContent = share === 0 ? 'off' : `${Math.round(100 * share)} %`;
    this.world.show({cut: share});
  }

  /** 'translate' or 'rotate'. */
  setHandles(mode) {
    document.querySelector(`input[name=gizmo][value=${mode}]`).checked = true;
    this.view.setHandles({mode});
  }

  tellLevels() {
    const {world} = this, levels = world.levels(), {mode} = world.settings, slider = $('level');
    slider.disabled = levels.length < 2;
    slider.max = Math.max(0, levels.length - 1);
    slider.value = world.settings.level;
    const [a, b] = levels[slider.value] ?? [];
    const text = mode === 'surface' ? '–' :
        a === b                     ? `${whole(a)} each` :
                                      `${whole(a)}, ${whole(b)}`;
    $('level-told').textContent = text;
    slider.setAttribute(
        'aria-valuetext',
        mode === 'surface' ? 'none' : `${text} ${mode === 'tree' ? 'balls' : 'spheres'}`);
  }

  tellLegend() {
    for (const [name, on] of Object.entries(this.world.overlays.shown)) {
      document.body.classList.toggle(name, on);
    }
  }
}
