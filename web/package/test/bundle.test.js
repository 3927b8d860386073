// A user's app, by Vite's server while one works on it and by its bundle; the types, by the
// compiler.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {copyFileSync, cpSync, mkdirSync, readdirSync, rmSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {build, createServer} from 'vite';

import {browser, open, serve} from './browser.js';
import {buildFolder, packageFolder, pairs, root} from './data.js';

const app = join(buildFolder, 'app');
let chrome;

/** The package as npm would publish it, installed in an app of its own. */
before(async () => {
  rmSync(app, {recursive: true, force: true});
  cpSync(join(packageFolder, 'test/app'), app, {recursive: true});
  mkdirSync(join(app, 'public'), {recursive: true});
  copyFileSync(pairs()[0].a, join(app, 'public/asset.ist'));
  const packed = execFileSync('npm', ['pack', '--silent', '--pack-destination', app], {
                   cwd: packageFolder,
                   encoding: 'utf8'
                 }).trim();
  const installed = join(app, 'node_modules/ist-query');
  mkdirSync(installed, {recursive: true});
  execFileSync('tar', ['xf', join(app, packed), '-C', installed, '--strip-components=1']);
  chrome = await browser();
});
after(() => chrome?.close());

async function volumes(url) {
  const complaints = [];
  const page = await open(chrome, url, complaints);
  await page.waitForFunction('window.told !== undefined', undefined, {timeout: 60000});
  const told = await page.evaluate('window.told');
  await page.close();
  assert.deepEqual(complaints, []);
  assert.ok(Array.isArray(told), told);
  assert.ok(told[0] > 0 && told[0] === told[1], String(told));
}

test('what npm would publish', () => {
  const files = readdirSync(join(app, 'node_modules/ist-query'), {recursive: true}).map(String);
  for (const file
           of ['package.json', 'index.d.ts', 'README.md', 'LICENSE', 'dist/ist.wasm', 'dist/inlined.js',
               'src/index.js'])
    assert.ok(files.includes(file), file);
  assert.ok(!files.some((file) => /test|\.c$|\.h$|CMake/.test(file)), files.join());
});

test('Vite: a bundle', async () => {
  await build(
      {root: app, base: './', logLevel: 'error', build: {outDir: 'dist', target: 'es2022'}});
  const server = await serve({'/below/': join(app, 'dist')});
  await volumes(`${server.url}/below/`);
  server.close();
});

test('Vite: its server', async () => {
  const server =
      await createServer({root: app, logLevel: 'error', server: {port: 0, host: '127.0.0.1'}});
  await server.listen();
  await volumes(`http://127.0.0.1:${server.httpServer.address().port}/`);
  await server.close();
});

test('Node, by name', () => {
  const script = `for (const name of ['ist-query', 'ist-query/compat']) {
    const ist = await import(name); await ist.init(); console.log(ist.version()); }`;
  const told = execFileSync(
      process.execPath, ['--input-type=module', '-e', script], {cwd: app, encoding: 'utf8'});
  assert.match(told, /^(\d+\.\d+\.\d+)\n\1\n$/);
});

test('the types', () => {
  execFileSync(
      process.execPath,
      [
        join(root, 'web/node_modules/typescript/bin/tsc'), '--noEmit', '--strict', '--target',
        'es2022', '--module', 'esnext', '--moduleResolution', 'bundler', '--lib', 'es2022,dom',
        'types.ts'
      ],
      {cwd: app, stdio: ['ignore', 'inherit', 'inherit']});
});
