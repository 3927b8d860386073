// Draws pictures of docs/ with the playground: node pictures.js [FOLDER]

import {readFileSync} from 'node:fs';
import {join} from 'node:path';

import {browser, serve} from '../package/test/browser.js';
import {root} from '../package/test/data.js';

import {siteFolder} from './build.js';
import {chart} from './chart.js';

const folder = process.argv[2] ?? join(root, 'docs/pictures');
const server = await serve({'/': siteFolder}), chrome = await browser();

/**
 * A figure of the solids alone. `how`: caption (COUNT: A's spheres), pair, spheres, mode, level,
 * shares, overlays shown, size; `move`: a part of the tray, and by how much [u].
 */
async function shot(how) {
  const [width, height] = how.size ?? [350, 430];
  const page = await chrome.newPage({viewport: {width, height}, colorScheme: 'light'});
  await page.goto(`${server.url}/`);
  await page.waitForFunction('window.playground?.world.contact?.best');
  const count = await page.evaluate(async (how) => {
    const {world, tray, view, setMode, choose} = playground;
    document.body.classList.add('bare');
    document.getElementById('pair').value = how.pair ?? 'bolt-nut';
    document.getElementById('spheres').value = how.spheres ?? 10000;
    await choose();
    setMode(how.mode ?? 'surface');
    Object.assign(
        world.overlays.shown, {arrows: false, patches: false, overlap: false, gap: false},
        how.overlays);
    world.show(
        {level: how.level ?? 0, opacityA: how.a ?? 1, opacityB: how.b ?? 1, cut: how.cut ?? 0});
    view.resize();
    const stage = how.move ? tray : world;
    stage.frame();
    view.camera.position.sub(view.orbit.target)
        .multiplyScalar(how.far ?? 0.82)
        .add(view.orbit.target);
    view.orbit.update();
    view.handles.detach();
    view.floor.visible = false;
    view.setColours({ground: '#ffffff', line: '#ffffff', handle: '#000000', held: '#000000'});
    if (how.move) {
      const [name, ...by] = how.move;
      tray.take(tray.solids.find((solid) => solid.name === name));
      tray.move(view.up.clone().fromArray(by));
      view.handles.detach();
    }
    stage.update(0);
    view.dirty = true;
    await new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)));
    return world.a.levels('spheres')[how.level ?? 0];
  }, how);
  const png = await page.screenshot();
  await page.close();
  return `<figure><img width="${width}" height="${height}" src="data:image/png;base64,${
      png.toString('base64')}">
    ${
      how.caption ?
          `<figcaption>${how.caption.replace('COUNT', count.toLocaleString('en'))}</figcaption>` :
          ''}</figure>`;
}

/** Figures side by side, or an SVG, as a file. */
async function write(name, content) {
  const page = await chrome.newPage({viewport: {width: 1200, height: 800}});
  await page.setContent(`<style>
      body { margin: 0 } #picture { display: inline-flex; background: #fff; padding-bottom: 10px }
      figure { margin: 0 } figcaption { font: 14px 'DejaVu Sans', sans-serif; color: #4a525c; text-align: center }
    </style>${content}`);
  await page.locator('#picture').screenshot({path: join(folder, name)});
  await page.close();
  console.log(join(folder, name));
}
async function row(name, views) {
  const figures = [];
  for (const view of views) figures.push(await shot(view));
  await write(name, `<div id="picture">${figures.join('')}</div>`);
}

await row('bolt_and_nut.png', [
  {caption: 'two meshes'},
  {caption: 'filled with spheres', mode: 'spheres', cut: 0.5},
  {caption: 'their overlap', a: 0.22, b: 0.3, overlays: {overlap: true, arrows: true}},
]);
await row('packing_levels.png', [0, 1, 2].map((level) => ({
                                                caption: 'COUNT spheres',
                                                mode: 'spheres',
                                                level,
                                                cut: 0.5,
                                                b: 0,
                                              })));
await row('nut_patches.png', [
  {b: 0.25, overlays: {patches: true, arrows: true}, size: [460, 480]},
]);
await row('tray.png', [
  {pair: 'tray', move: ['nut 6', 2, 40, 4], far: 0.74, size: [640, 440]},
]);

const trade = JSON.parse(readFileSync(join(root, 'benchmarks/results/trade.json'), 'utf8'));
await write(
    'spheres_and_error.png',
    chart(
        trade.tables.Trade
            .filter(
                (row) =>
                    row.pair === 'eledino' && row.curve === 'matched' && row.class !== 'contained')
            .map((row) => ({
                   class: `overlap ${row.class}`,
                   spheres: Number(row.setting),
                   error: row['error median %'],
                 })),
        'spheres of each solid; median error of the volume'));

await chrome.close();
server.close();
