// What is known of two solids at a pose: every query that the page shows, into the same answers.

import {contactPatches, lenses, penetration, separation} from 'ist-query';

export const kMostPatches = 16;
export const kMostLenses = 4096;
const kWarmUp = 40;  // [ms]
const kTimed = 10;

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

  /** What was just compiled is slow at first; times are told from then on. */
  warm(pose) {
    let start = performance.now();
    while (performance.now() - start < kWarmUp) this.ask(pose, {patches: true, lens: true});
    start = performance.now();
    for (let i = 0; i < kTimed; ++i) this.askNumbers(pose);
    this.usual = (performance.now() - start) / kTimed;
  }

  /** Asks at a pose of B, for patches and lenses only where they are shown. */
  ask(pose, {patches = false, lens = false} = {}) {
    const {a, b, options} = this, start = performance.now();
    this.askNumbers(pose);
    this.time = performance.now() - start;
    if (patches) {
      this.patches = options.patches.into = contactPatches(a, b, pose, options.patches);
    }
    if (lens) this.lenses = options.lenses.into = lenses(a, b, pose, options.lenses);
  }

  askNumbers(pose) {
    const {a, b, options} = this;
    this.penetration = options.penetration.into = penetration(a, b, pose, options.penetration);
    this.separation = options.separation.into = separation(a, b, pose, options.separation);
  }
}
