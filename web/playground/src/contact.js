// What is known of two solids at a pose: every query that the page shows, into the same answers.

import {contactPatches, lenses, penetration, separation} from 'ist-query';

export const kMostPatches = 16;
export const kMostLenses = 4096;

export class Contact {
  constructor(a, b) {
    this.a = a;
    this.b = b;
    this.options = {
      penetration: {},
      separation: {},
      patches: {maxPatches: kMostPatches},
      lenses: {maxLenses: kMostLenses},
    };
    this.time = 0;  // [ms] of penetration and separation, those asked last
  }

  /** Asks at a pose of B, for patches and lenses only where they are shown. */
  ask(pose, {patches = false, lens = false} = {}) {
    const {a, b, options} = this, start = performance.now();
    this.penetration = options.penetration.into = penetration(a, b, pose, options.penetration);
    const asked = performance.now();
    this.separation = options.separation.into = separation(a, b, pose, options.separation);
    this.time = asked - start;
    if (patches) {
      this.patches = options.patches.into = contactPatches(a, b, pose, options.patches);
    }
    if (lens) this.lenses = options.lenses.into = lenses(a, b, pose, options.lenses);
  }
}
