// For environments that lose a file beside the module: the WebAssembly is in the module.

import {inlined} from '../dist/inlined.js';

import {load} from './memory.js';

export * from './public.js';

export function init(options) {
  return load(options, () => Uint8Array.from(atob(inlined), (c) => c.charCodeAt(0)));
}
