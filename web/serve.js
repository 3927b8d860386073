// Serves this folder: node serve.js [PORT]
import {fileURLToPath} from 'node:url';

import {serve} from './package/test/browser.js';

const {url} = await serve(
    {'/': fileURLToPath(new URL('.', import.meta.url))}, Number(process.argv[2] ?? 8080));
console.log(`${url}/   (Ctrl+C ends it)`);
