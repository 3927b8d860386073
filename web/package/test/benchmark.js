// Size of the package, and times of its queries compared with the native library's in the same run:
// ./dev web bench

import * as ist from 'ist-query';
import {readFileSync, statSync} from 'node:fs';
import {join} from 'node:path';
import {brotliCompressSync, gzipSync} from 'node:zlib';

import {browser, open, serve} from './browser.js';
import {nativeTimes, packageFolder, pairs, read} from './data.js';
import {rowTimes} from './rows.js';

const kSpheres = 10000, kPasses = 3, kRounds = 5;

for (const file of ['dist/ist.wasm', 'dist/inlined.js']) {
  const bytes = readFileSync(join(packageFolder, file));
  console.log(
      `${file}: ${bytes.length} bytes, ${gzipSync(bytes, {level: 9}).length} by gzip, ` +
      `${brotliCompressSync(bytes).length} by brotli`);
}

const server = await serve({'/': packageFolder}), chrome = await browser();
const page = await open(chrome, `${server.url}/test/empty.html`);
await ist.init();

/** Times in the page. */
async function pageTimes({a, b, csv, passes}) {
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const ist = await import('/src/index.js');
  const {rowTimes} = await import('/test/rows.js');
  await ist.init();
  return rowTimes(ist, bytes(a), bytes(b), csv, passes);
}

const smaller = (best, times) => {
  for (const [query, time] of Object.entries(times))
    best[query] = Math.min(best[query] ?? Infinity, time);
};

console.log(
    `\nNode ${process.version}, Chromium ${
        chrome.version()}. µs a query: mean over the rows, best of ` +
    `${kPasses * kRounds} passes, the three taking turns.`);
for (const pair of pairs(kSpheres)) {
  const bytes = [read(pair.a), read(pair.b)], csv = read(pair.csv).toString();
  const [a, b] = bytes.map((data) => data.toString('base64'));
  const native = {}, node = {}, chromium = {};
  for (let round = 0; round < kRounds; ++round) {
    smaller(native, nativeTimes(pair, kPasses));
    smaller(node, rowTimes(ist, ...bytes, csv, kPasses));
    smaller(chromium, await page.evaluate(pageTimes, {a, b, csv, passes: kPasses}));
  }
  console.log(
      `\n${pair.name}, ${kSpheres} spheres, ${
          (statSync(pair.a).size + statSync(pair.b).size) / 1e6} MB of assets\n` +
      '\n| query | native | Node | Chromium | Node / native | Chromium / native |\n|---|---|---|---|---|---|');
  for (const query of Object.keys(native))
    console.log(
        `| ${query} | ${native[query].toFixed(1)} | ${node[query].toFixed(1)} | ${
            chromium[query].toFixed(1)} | ` +
        `${(node[query] / native[query]).toFixed(1)} | ${
            (chromium[query] / native[query]).toFixed(1)} |`);
}
await chrome.close();
server.close();
