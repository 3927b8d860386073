// Bakes the page's data and bundles it: node build.js. Any static server can serve the folder.

import {copyFileSync, mkdirSync} from 'node:fs';
import {join} from 'node:path';
import {fileURLToPath} from 'node:url';
import {build} from 'vite';

import {buildFolder, root} from '../package/test/data.js';

import {bakeDemo, demoFolder} from './demo.js';

export const siteFolder = join(buildFolder, 'playground/site');

/** Linked documents, as text, which every browser displays. */
const kAbout = {'guide.txt': 'docs/user_guide.md', 'web.txt': 'docs/web.md', 'licence.txt': 'LICENSE'};

export async function buildSite() {
  bakeDemo();
  mkdirSync(join(demoFolder, 'about'), {recursive: true});
  for (const [name, from] of Object.entries(kAbout))
    copyFileSync(join(root, from), join(demoFolder, 'about', name));
  await build({configFile: fileURLToPath(new URL('vite.config.js', import.meta.url))});
}

if (process.argv[1] === import.meta.filename) await buildSite();
