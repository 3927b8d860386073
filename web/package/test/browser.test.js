import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';

import {browser, open, serve} from './browser.js';
import {firstDifference, nativeAnswers, packageFolder, pairs, read} from './data.js';

let server, chrome;
before(async () => {
  server = await serve({'/': packageFolder});
  chrome = await browser();
});
after(async () => {
  await chrome?.close();
  server?.close();
});

/** Runs in the page: the answers to a table by one build. */
async function answers({module, a, b, csv}) {
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const ist = await import(module);
  const {rowsText} = await import('/test/rows.js');
  await ist.init();
  return rowsText(ist, bytes(a), bytes(b), csv);
}

for (const pair of pairs())
  test(`the bits of the native library in Chromium: ${pair.name}`, async () => {
    const complaints = [];
    const page = await open(chrome, `${server.url}/test/empty.html`, complaints);
    const wanted = nativeAnswers(pair);
    const [a, b] = [read(pair.a), read(pair.b)].map((bytes) => bytes.toString('base64'));
    for (const module of ['/src/index.js', '/src/compat.js']) {
      const got = await page.evaluate(answers, {module, a, b, csv: read(pair.csv).toString()});
      assert.equal(firstDifference(wanted, got), null, module);
    }
    assert.deepEqual(complaints, []);
    await page.close();
  });

test('a page that does not await init(), and one whose WebAssembly is not there', async () => {
  const page = await open(chrome, `${server.url}/test/empty.html`);
  const told = await page.evaluate(async () => {
    const ist = await import('/src/index.js');
    const said = [];
    const note = (call) => {
      try {
        call();
      } catch (error) {
        said.push(String(error));
      }
    };
    note(() => ist.Asset.from(new ArrayBuffer(0)));
    await ist.init({wasm: '/nowhere.wasm'}).catch((error) => said.push(String(error)));
    await ist.init({wasm: '/test/empty.html'}).catch((error) => said.push(String(error)));
    ist.init();
    note(() => ist.version());
    await ist.init();
    said.push(ist.version());
    return said;
  });
  assert.match(told[0], /call and await init\(\) first/);
  assert.match(told[1], /nowhere\.wasm cannot be fetched: 404.*ist-query\/compat/);
  assert.match(told[2], /empty\.html is not a WebAssembly/);
  assert.match(told[3], /init\(\) was called, but not awaited/);
  assert.match(told[4], /^\d+\.\d+\.\d+$/);
  await page.close();
});

test('in a worker', async () => {
  const page = await open(chrome, `${server.url}/test/empty.html`);
  const told = await page.evaluate(
      () => new Promise((done) => {
        const text = `import * as ist from '${location.origin}/src/index.js';
      await ist.init(); postMessage(ist.version());`;
        const worker = new Worker(
            URL.createObjectURL(new Blob([text], {type: 'text/javascript'})), {type: 'module'});
        worker.onmessage = (event) => done(event.data);
        worker.onerror = (event) => done(event.message);
      }));
  assert.match(told, /^\d+\.\d+\.\d+$/);
  await page.close();
});
