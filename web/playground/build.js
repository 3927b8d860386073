// Bakes what the page shows and bundles it: node build.js. The folder it leaves wants no server's
// logic.

import {join} from 'node:path';
import {fileURLToPath} from 'node:url';
import {build} from 'vite';

import {buildFolder} from '../package/test/data.js';

import {bakeDemo} from './demo.js';

export const siteFolder = join(buildFolder, 'playground/site');

export async function buildSite() {
  bakeDemo();
  await build({configFile: fileURLToPath(new URL('vite.config.js', import.meta.url))});
}

if (process.argv[1] === import.meta.filename) await buildSite();
