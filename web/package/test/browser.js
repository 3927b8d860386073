// A folder served to a real browser.

import {readFile} from 'node:fs/promises';
import {createServer} from 'node:http';
import {extname, join, normalize} from 'node:path';
import {chromium} from 'playwright-core';

const kTypes = {
  '.html': 'text/html',
  '.js': 'text/javascript',
  '.css': 'text/css',
  '.json': 'application/json',
  '.wasm': 'application/wasm',
  '.svg': 'image/svg+xml',
  '.png': 'image/png',
  '.txt': 'text/plain; charset=utf-8',
};

/**
 * Serves files: `folders` by prefix of their address, longest first. `port` 0: any.
 * Returns the address, and a function that stops it.
 */
export async function serve(folders, port = 0) {
  const prefixes = Object.keys(folders).sort((a, b) => b.length - a.length);
  const server = createServer(async (request, response) => {
    let path = decodeURIComponent(new URL(request.url, 'http://here').pathname);
    if (path.endsWith('/')) path += 'index.html';
    const prefix = prefixes.find((p) => path.startsWith(p));
    try {
      if (prefix === undefined) throw new Error();
      const body =
          await readFile(join(folders[prefix], normalize('/' + path.slice(prefix.length))));
      response.writeHead(200, {'content-type': kTypes[extname(path)] ?? 'application/octet-stream'})
          .end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((ready, fail) => server.once('error', fail).listen(port, '127.0.0.1', ready));
  return {url: `http://127.0.0.1:${server.address().port}`, close: () => server.close()};
}

/** Debian's Chromium, without a window. */
export function browser() {
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: ['--no-sandbox', '--disable-gpu', '--disable-dev-shm-usage'],
  });
}

/** A page at an address; its errors go to `complaints`. */
export async function open(chrome, url, complaints = []) {
  const page = await chrome.newPage();
  page.on('console', (message) => {
    if (message.type() === 'error') complaints.push(message.text());
  });
  page.on('pageerror', (error) => complaints.push(String(error)));
  await page.goto(url);
  return page;
}
