// The page in a real browser; ./dev web has built it.
import assert from 'node:assert/strict';
import {join} from 'node:path';
import {after, before} from 'node:test';

import {browser, serve} from '../../package/test/browser.js';
import {siteFolder} from '../build.js';

// Small: a rasteriser in software draws it.
export const kDesk = {
  viewport: {width: 900, height: 480}
};
export const kPhone = {
  viewport: {width: 390, height: 844},
  hasTouch: true,
  isMobile: true
};

export let server, chrome;
before(async () => {
  server = await serve({'/': siteFolder});
  chrome = await browser();
});
after(async () => {
  await chrome?.close();
  server?.close();
});

export const asset = (name, spheres = 4000) => join(siteFolder, `demo/${name}_${spheres}.ist`);

/** Runs `act` on a fresh page that has asked its first pair; it must not have complained. */
export async function visit(act, options = kDesk) {
  const context = await chrome.newContext(options), page = await context.newPage();
  const complaints = [];
  page.on('console', (message) => {
    if (message.type() === 'error') complaints.push(message.text());
  });
  page.on('pageerror', (error) => complaints.push(String(error)));
  await page.goto(`${server.url}/`);
  await page.waitForFunction('window.playground?.world.contact?.best');
  await act(page);
  await context.close();
  assert.deepEqual(complaints, []);
}

export async function choose(page, pair, spheres = 4000) {
  await page.evaluate(async ([pair, spheres]) => {
    document.getElementById('pair').value = pair;
    document.getElementById('spheres').value = spheres;
    await playground.choose();
  }, [pair, spheres]);
}

/** Drops files {name, bytes} on the page. */
export async function drop(page, files) {
  const data = files.map(({name, bytes}) => ({name, text: Buffer.from(bytes).toString('base64')}));
  await page.evaluate((data) => {
    const dataTransfer = new DataTransfer();
    for (const {name, text} of data) {
      dataTransfer.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
    }
    for (const kind of ['dragenter', 'dragover', 'drop']) {
      document.body.dispatchEvent(
          new DragEvent(kind, {dataTransfer, bubbles: true, cancelable: true}));
    }
  }, data);
}

export const number = (text) => Number(text.replaceAll('−', '-'));
export const pose = (page) => page.evaluate(() => structuredClone(playground.world.pose));

/** [px] A point on the handle that moves B along z. */
export const handle = (page) => page.evaluate(() => {
  const {view, world} = playground, {camera} = view;
  const at = world.b.group.position.clone();
  const reach = at.distanceTo(camera.position) * 1.9 * Math.tan(camera.fov * Math.PI / 360) / 4;
  at.z += 0.45 * reach * view.handles.size;
  at.project(camera);
  const {left, top, width, height} = view.canvas.getBoundingClientRect();
  return [left + (at.x + 1) / 2 * width, top + (1 - at.y) / 2 * height];
});
