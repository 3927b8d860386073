// The common part of all builds of the package; each has its own init().

import {functions} from './memory.js';

export {Asset, Shape} from './asset.js';
export {contactPatchesBatch, penetrationBatch} from './batch.js';
export {sizeMatch, patchesWithoutProtrusion, withoutProtrusion, wrenches} from './bodies.js';
export {IstError} from './error.js';
export {motionBetween, moved, timeOfImpact} from './motion.js';
export {contactPatches, lenses, overlap, overlapOutline, penetration, separation} from './query.js';
export {Scene} from './scene.js';
export {closestPoint, contains, raycast} from './surfaces.js';

export function version() {
  const number = functions('version()').version();
  return [Math.floor(number / 10000), Math.floor(number / 100) % 100, number % 100].join('.');
}
