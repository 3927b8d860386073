// What every build of the package has; init() is each one's own.

import {functions} from './memory.js';

export {Asset, Field} from './asset.js';
export {IstError} from './error.js';
export {contactPatches, lenses, overlap, penetration, separation} from './query.js';

export function version() {
  const number = functions('version()').version();
  return [Math.floor(number / 10000), Math.floor(number / 100) % 100, number % 100].join('.');
}
