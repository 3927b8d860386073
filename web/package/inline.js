// Writes dist/inlined.js, a module that contains dist/ist.wasm as text, for src/compat.js.
import {readFile, writeFile} from 'node:fs/promises';

const bytes = await readFile(new URL('dist/ist.wasm', import.meta.url));
await writeFile(
    new URL('dist/inlined.js', import.meta.url),
    `export const inlined = '${bytes.toString('base64')}';\n`);
