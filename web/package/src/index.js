// For pages: the WebAssembly is a file beside the module.

import {load} from './memory.js';

export * from './public.js';

export function init(options) {
  return load(options, () => new URL('../dist/ist.wasm', import.meta.url));
}
