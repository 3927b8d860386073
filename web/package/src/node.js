// For Node, whose fetch() reads no files.

import {readFile} from 'node:fs/promises';

import {load} from './memory.js';

export * from './public.js';

export function init(options) {
  return load(options, () => readFile(new URL('../dist/ist.wasm', import.meta.url)));
}
