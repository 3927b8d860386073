// The WebAssembly module: loading it, and its memory.

import {IstError} from './error.js';
import {checkOptions} from './options.js';

/** The module's exported functions; null before init(). */
let wasm = null;
let loading = null;

// Views of the current memory: growing detaches older views.
let doubles, words, bytes;

function refresh() {
  if (bytes !== undefined && bytes.byteLength !== 0) return;
  const buffer = wasm.memory.buffer;
  doubles = new Float64Array(buffer);
  words = new Uint32Array(buffer);
  bytes = new Uint8Array(buffer);
}

/** The imports of the WebAssembly. */
const imports = {
  env: {
    emscripten_notify_memory_growth: () => {
      bytes = undefined;
    }
  },
  wasi_snapshot_preview1: {
    clock_time_get(clock, precision, out) {
      const now = BigInt(Math.round(performance.now() * 1e6));
      new DataView(wasm.memory.buffer).setBigUint64(out, now, true);
      return 0;
    },
    proc_exit() {
      throw new IstError('ist: the WebAssembly module aborted: out of memory, or a number out of range');
    },
  },
};

const kRemedy = 'If a bundler moved it, pass its address, init({wasm: url}), or import ' +
    '"ist-query/compat", which contains it.';

async function instantiated(source) {
  let given = await source;
  if (typeof given === 'string' || given instanceof URL) {
    try {
      given = await fetch(given);
    } catch (error) {
      throw new IstError(
          `ist: ${given} cannot be fetched (${error.message}). ${kRemedy}`);
    }
  }
  if (given instanceof WebAssembly.Module) return WebAssembly.instantiate(given, imports);
  if (typeof Response !== 'undefined' && given instanceof Response) {
    if (!given.ok)
      throw new IstError(
          `ist: ${given.url} cannot be fetched: ${given.status} ${given.statusText}. ${kRemedy}`);
    const address = given.url;
    given = await given.arrayBuffer();
    // Detects a server that answers every request with a page.
    const magic = new Uint8Array(given, 0, Math.min(4, given.byteLength));
    if (String.fromCharCode(...magic) !== '\0asm')
      throw new IstError(
          `ist: ${address} is not a WebAssembly module. ${kRemedy}`);
  }
  const {instance} = await WebAssembly.instantiate(given, imports);
  return instance;
}

async function start(source) {
  if (typeof WebAssembly !== 'object')
    throw new IstError('ist: WebAssembly is not available. Use a browser of 2023 or later.');
  let instance;
  try {
    instance = await instantiated(source);
  } catch (error) {
    if (error instanceof WebAssembly.CompileError)
      throw new IstError(
          `ist: this WebAssembly cannot be compiled (${error.message}). It needs SIMD: ` +
          'Chrome 91, Firefox 89, Safari 16.4, Node 16.4 or later.');
    throw error;
  }
  wasm = instance.exports;
  bytes = undefined;
  try {
    wasm._initialize();
    if (wasm.start() !== 0) throw new IstError('no memory');
  } catch {
    wasm = null;
    throw new IstError('ist: out of memory: queries need 42 MB');
  }
}

/** Loads the module once, from the source in the options of init(), else from `usual()`. */
export async function load(options, usual) {
  checkOptions('init()', options);
  loading ??= start(options?.wasm ?? usual()).catch((error) => {
    loading = null;
    throw error;
  });
  return loading;
}

/** The module's functions; `who`: the caller, for messages. */
export function functions(who) {
  if (wasm === null)
    throw new IstError(
        `ist: ${who} was called before the WebAssembly was loaded: ` +
        (loading === null ? 'call and await init() first' : 'init() was called, but not awaited'));
  return wasm;
}

// Views of the current memory.
export function f64() {
  refresh();
  return doubles;
}
export function u32() {
  refresh();
  return words;
}
export function u8() {
  refresh();
  return bytes;
}

/** `size` bytes on a 64-byte boundary. */
export function take(size) {
  const place = size < 2 ** 32 ? wasm.take(size) >>> 0 : 0;
  if (place === 0) throw new IstError(`ist: out of memory for ${size} more bytes`);
  return place;
}
export function give(place) {
  wasm.give(place);
}

/** Allocates `size` bytes while `use(place)` runs. */
export function withRoom(size, use) {
  const place = take(size);
  try {
    return use(place);
  } finally {
    give(place);
  }
}

/** Memory that is kept from call to call, as large as the largest request. */
export class Room {
  #place = 0;
  #size = 0;

  of(size) {
    if (size > this.#size) {
      const next = take(size);
      if (this.#place !== 0) give(this.#place);
      this.#place = next;
      this.#size = size;
    }
    return this.#place;
  }
}

/** The library's message for a status. */
export function describe(status) {
  const memory = u8();
  const start = wasm.describe(status) >>> 0;
  return new TextDecoder().decode(memory.subarray(start, memory.indexOf(0, start)));
}

/** Throws if `status` is an error; `what`: the query or the object read. */
export function check(status, what) {
  if (status < 0) throw new IstError(`ist: ${what}: ${describe(status)}`, status);
}
