// The queries of two solids at a pose that the page shows, with reused answers.

import {contactPatches, overlapOutline, penetration, separation} from 'ist-query';

export const kMostPatches = 16;
const kTimedFor = 5;    // [ms] a browser's clock is coarse
export const kTimedOften = 16;  // times; the least is shown

export class Contact {
  constructor(a, b) {
    this.a = a;
    this.b = b;
    this.hasMeshes = [a, b].every((solid) => solid.info().meshTriangles > 0);
    this.options = {
      spheres: {},
      exact: {measure: 'exact'},
      separation: {},
      patches: {maxPatches: kMostPatches},
      outline: {maxPatches: 1},
    };
    this.times = {spheres: Infinity, exact: Infinity};  // [ms] of a penetration at this pose
    this.timed = 0;
  }

  /** Queries a pose of B; patches and the overlap's outline only if they are shown. */
  ask(pose, {patches, overlap}) {
    const {a, b, options, hasMeshes} = this;
    this.askSpheres(pose);
    this.separation = options.separation.into = separation(a, b, pose, options.separation);
    if (patches) this.patches = options.patches.into = contactPatches(a, b, pose, options.patches);
    if (hasMeshes && overlap) {
      this.outline = options.outline.into = overlapOutline(a, b, pose, options.outline);
      this.exact = this.outline.contact.whole;  // the bits of penetration()
    } else if (hasMeshes) {
      this.askExact(pose);
    }
    this.timed = 0;
  }

  askSpheres(pose) {
    const {a, b, options} = this;
    this.spheres = options.spheres.into = penetration(a, b, pose, options.spheres);
  }
  askExact(pose) {
    const {a, b, options} = this;
    this.exact = options.exact.into = penetration(a, b, pose, options.exact);
  }

  /** The true overlap; by spheres if a solid has no mesh. */
  get best() {
    return this.exact ?? this.spheres;
  }

  /** Measures the last queries, a little each frame; returns true if there are new times. */
  time(pose) {
    if (this.timed === kTimedOften) return false;
    const {times} = this;
    if (this.timed++ === 0) times.spheres = times.exact = Infinity;
    times.spheres = Math.min(times.spheres, meanTime(() => this.askSpheres(pose)));
    if (this.hasMeshes) times.exact = Math.min(times.exact, meanTime(() => this.askExact(pose)));
    return this.timed === kTimedOften;
  }
}

/** [ms] */
export function meanTime(act) {
  const start = performance.now();
  let count = 0, time;
  do {
    act();
    ++count;
    time = performance.now() - start;
  } while (time < kTimedFor);
  return time / count;
}
