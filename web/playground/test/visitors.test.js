// Twenty parts; phones, keys and screen readers.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {join} from 'node:path';
import {test} from 'node:test';
import * as ist from 'ist-query';

import {root} from '../../package/test/data.js';

import {triangleGlb} from './glb.js';
import {asset, choose, drop, handle, kDesk, kPhone, number, pose, visit} from './page.js';

const axe = readFileSync(join(root, 'web/node_modules/axe-core/axe.min.js'), 'utf8');

/** [px] The middle of a part on the tray. */
const middle = (page, name) => page.evaluate((name) => {
  const {tray, view} = playground;
  const {group, bounds} = tray.solids.find((solid) => solid.name === name);
  group.updateMatrixWorld();
  const at = group.localToWorld(group.position.clone().fromArray(bounds.centre)).project(view.camera);
  const {left, top, width, height} = view.canvas.getBoundingClientRect();
  return [left + (at.x + 1) / 2 * width, top + (1 - at.y) / 2 * height];
}, name);

/** The list of pairs, by their names: volume or gap, force, event. */
const listed = (page) => page.evaluate(
    () => Object.fromEntries([...document.querySelectorAll('#pairs tr')].map((row) => {
      const [names, ...told] = [...row.cells].map((cell) => cell.textContent);
      return [names, told];
    })));

/** Where parts stand, and the scene's pairs that overlap, the largest first. */
const tray = (page) => page.evaluate(() => {
  const {tray} = playground;
  tray.update();
  return {
    poses: Object.fromEntries(tray.solids.map(({name, group: {position, quaternion: {x, y, z, w}, scale}}) => [
      name, {rotation: [w, x, y, z], translation: position.toArray(), scale: scale.x}
    ])),
    pairs: tray.ranked().filter(({volume}) => volume > 0).map(
        ({a, b, volume, force}) => ({names: [a.name, b.name], volume, force})),
  };
});

/** Every overlap on the tray is what penetration() says of the two parts alone, and none is missing. */
async function confirm({poses, pairs}) {
  await ist.init();
  const assets = {};
  for (const name of ['gear', 'bolt', 'nut']) assets[name] = ist.Asset.from(readFileSync(asset(name)), name);
  const names = Object.keys(poses), wanted = [];
  const of = (name) => assets[name.split(' ')[0]];
  names.forEach((a, i) => names.slice(i + 1).forEach((b) => {
    const {volume, force} = ist.penetration(of(a), of(b), poses[b], {measure: 'exact', poseA: poses[a]});
    if (volume > 0) wanted.push({names: [a, b], volume, force: Math.hypot(...force)});
  }));
  for (const solid of Object.values(assets)) solid.free();
  assert.equal(names.length, 20);
  assert.deepEqual(pairs, wanted.toSorted((p, q) => q.volume - p.volume));
}

test(
    'twenty parts: one dragged into others makes pairs, and ends them again',
    () => visit(async (page) => {
      await choose(page, 'tray');
      await page.waitForFunction(() => document.querySelectorAll('#pairs .stays').length >= 2);
      const before = await listed(page), [x, y] = await middle(page, 'bolt 6');
      assert.ok(Object.keys(before)[0].startsWith('gear'), JSON.stringify(before));
      await confirm(await tray(page));
      assert.match(await page.locator('#hint').textContent(), /^Drag any part/);

      const eye = () => page.evaluate(() => playground.view.camera.position.toArray().join());
      const seen = await eye();
      await page.mouse.move(x, y);
      assert.equal(await page.evaluate(() => playground.view.holder.style.cursor), 'grab');
      await page.mouse.down();
      // The wait for a short-lived element begins before it can appear.
      const begins = page.locator('#pairs .begins').first().waitFor();
      for (let i = 1; i <= 12; ++i) await page.mouse.move(x + 2 * i, y - 3 * i);
      await begins;
      assert.equal(await page.locator('#part').inputValue(), 'bolt 6');
      assert.ok(await page.locator('#hint').isHidden());
      const met = await tray(page);
      assert.equal(met.poses['bolt 6'].translation[2], 21, 'along the floor');
      await confirm(met);
      assert.ok(met.pairs.some(({names}) => names.join() === 'gear 1,bolt 6'), JSON.stringify(met));
      await page.waitForTimeout(200);
      // The list has the same order and numbers, and stays.
      const during = await listed(page);
      const rows = Object.entries(during).filter(([, [, force]]) => force !== '');
      assert.deepEqual(
          rows.map(([names, [volume]]) => [names, number(volume)]),
          met.pairs.map(({names, volume}) => [names.join(', '), Number(volume.toPrecision(4))]));
      await page.waitForFunction(
          () => [...document.querySelectorAll('#pairs tr')].every(({className}) => className.startsWith('stays')));

      const ended = page.waitForFunction(
          () => [...document.querySelectorAll('#pairs .ended')].some(
              ({cells: [names]}) => names.textContent === 'gear 1, bolt 6'));
      for (let i = 11; i >= 0; --i) await page.mouse.move(x + 2 * i, y - 3 * i);
      await page.mouse.up();
      await ended;
      await page.waitForFunction(() => document.querySelectorAll('#pairs .ended').length === 0);
      assert.deepEqual(await listed(page), before);
      assert.equal(await eye(), seen, 'the view stood still');
      await page.waitForFunction(() => /^[\d,]+$/.test(document.getElementById('read-step').textContent));
      await page.waitForFunction(() => /^2 pairs overlap, most gear 2 and gear 3/.test(document.getElementById('live').textContent));

      // Beside the parts the view is turned; another choice takes the tray away.
      await page.mouse.move(20, 100);
      await page.mouse.down();
      await page.mouse.move(60, 100);
      await page.mouse.up();
      assert.notEqual(await eye(), seen);
      await choose(page, 'bolt-nut');
      assert.ok(await page.locator('#read-volume').isVisible() && await page.locator('#pairs').isHidden());
      assert.equal(await page.locator('#name-b').textContent(), 'B nut');
    }));

test(
    'twenty parts by keys alone',
    () => visit(async (page) => {
      const tabTo = async (id, key = 'Tab') => {
        for (let i = 0; i < 20; ++i) {
          if (await page.evaluate('document.activeElement.id') === id) return;
          await page.keyboard.press(key);
        }
        assert.fail(`no ${key} leads to ${id}`);
      };
      const pick = async (id, words) => {
        await tabTo(id);
        for (let i = 0; i < 5; ++i) {
          await page.keyboard.type(words);
          const chosen = await page.locator(`#${id}`).evaluate(({selectedOptions: [{text}]}) => text);
          if (chosen.startsWith(words)) return;
          // Letters typed slowly each choose anew, and a space opens the list. Escape clears them.
          await page.keyboard.press('Escape');
          await page.waitForTimeout(1500);
        }
        assert.fail(`no ${words}`);
      };
      await pick('pair', 'Twenty');
      await page.locator('#pairs tr').first().waitFor();
      await tabTo('view', 'Shift+Tab');
      // From gear 1 over its bolt to its nut, and back again to the bolt.
      for (const key of ['n', 'n', 'Shift+N']) await page.keyboard.press(key);
      assert.equal(await page.locator('#live').textContent(), 'bolt 1 in hand.');
      assert.equal(await page.locator('#part').inputValue(), 'bolt 1');
      for (let i = 0; i < 6; ++i) await page.keyboard.press('ArrowRight');
      await page.waitForFunction(
          () => [...document.querySelectorAll('#pairs tr')].some(
              ({cells: [names, , force]}) => names.textContent === 'bolt 1, nut 1' && force.textContent));
      const met = await tray(page);
      assert.ok(met.pairs.some(({names}) => names.join() === 'gear 1,bolt 1'));
      await confirm(met);
      await page.keyboard.press('r');
      assert.match(await page.locator('#live').textContent(), /^\d pairs overlap, most (bolt|gear) 1 and /);
      await page.keyboard.press('Home');
      assert.equal((await tray(page)).pairs.length, 2);
      await pick('part', 'nut 8');
      assert.equal(await page.evaluate(() => playground.tray.b.name), 'nut 8');
    }));

test(
    'twenty parts: sixty frames, and nothing flickers where two barely touch',
    () => visit(async (page) => {
      await choose(page, 'tray');
      await page.waitForFunction(() => document.querySelectorAll('#pairs .stays').length >= 2);
      // A gear lies on the head of its bolt, and on that of another, whose shaft is inside it. It
      // goes up and down by less than anybody sees.
      const {events, volumes, differ} = await page.evaluate(async () => {
        const {tray, view} = playground, up = tray.b.group.position.clone().set(0, 0, 1);
        const [gear] = tray.solids;
        tray.take(tray.solids.find(({name}) => name === 'bolt 6'));
        tray.move(up.clone().set(-6, 26, 0));
        tray.take(gear);
        const gl = view.renderer.getContext(), [, , wide, high] = gl.getParameter(gl.VIEWPORT);
        const events = new Set(), volumes = [], shots = [];
        const row = [...document.querySelectorAll('#pairs tr')].find(
            ({cells: [names]}) => names.textContent === 'gear 1, bolt 1');
        for (let i = 0; i <= 60; ++i) {
          tray.move(up.clone().setLength(i === 60 ? 1e-3 : i % 2 ? 4e-9 : -4e-9));
          await new Promise(requestAnimationFrame);
          events.add(row.isConnected ? row.cells[3].textContent : 'gone');
          volumes.push(tray.pairs.get('1 2').volume);
          if (i < 58) continue;
          view.dirty = true;
          view.render(tray.overlays);
          const pixels = new Uint8Array(4 * wide * high);
          gl.readPixels(0, 0, wide, high, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
          shots.push(pixels);
        }
        const [a, ...others] = shots;
        const differ = others.map((b) => a.filter((x, k) => Math.abs(x - b[k]) > 2).length);
        return {events: [...events], volumes, differ};
      });
      assert.ok(volumes.some((v) => v > 0) && volumes.some((v) => v === 0), volumes.join());
      assert.deepEqual({events, differ}, {events: ['stays'], differ: [0, 0]});
      assert.ok(await page.locator('#alert').isHidden());
    }, {viewport: {width: 620, height: 240}}));

test(
    'a finger drags a part of twenty on a phone',
    () => visit(async (page) => {
      await choose(page, 'tray');
      await page.locator('#pairs tr').first().waitFor();
      const [x, y] = await middle(page, 'nut 5'), fingers = await page.context().newCDPSession(page);
      const touch = (type, by) => fingers.send('Input.dispatchTouchEvent', {
        type,
        touchPoints: type === 'touchEnd' ? [] : [{x: x + by, y: y - by}],
      });
      const eye = () => page.evaluate(() => playground.view.camera.position.toArray().join());
      const seen = await eye();
      await touch('touchStart', 0);
      for (let i = 1; i <= 8; ++i) await touch('touchMove', 4 * i);
      await page.waitForFunction(() => playground.tray.ranked().some(({b, volume}) => b.name === 'nut 5' && volume > 0));
      await touch('touchEnd', 0);
      await confirm(await tray(page));
      assert.equal(await eye(), seen, 'the view stood still');
      assert.equal(await page.evaluate('scrollY'), 0);
      await fits(page);
    }, kPhone));

/** A phone's width holds everything, and a finger can press it. */
async function fits(page) {
  assert.equal(await page.evaluate('document.documentElement.scrollWidth'), 390);
  const outside = await page.evaluate(
      () => [...document.querySelectorAll('button, select, input, output, dd, figure, td')]
                .filter((part) => part.offsetParent)
                .filter((part) => {
                  const {left, right} = part.getBoundingClientRect();
                  return left < -0.5 || right > innerWidth + 0.5;
                })
                .map((part) => part.id || part.outerHTML));
  assert.deepEqual(outside, []);
  const small = await page.evaluate(
      () => [...document.querySelectorAll('button, select')]
                .filter((part) => part.offsetParent && part.getBoundingClientRect().height < 32)
                .map((part) => part.id));
  assert.deepEqual(small, []);
}

test('a phone: everything fits its width', () => visit(fits, kPhone));

/** What a rule book finds: whatever it calls serious or worse. */
async function offences(page) {
  await page.evaluate(axe);
  const {violations} = await page.evaluate(() => window.axe.run());
  return violations.filter(({impact}) => ['serious', 'critical'].includes(impact))
      .map(({id, nodes}) => `${id}: ${nodes.map(({html}) => html.slice(0, 120)).join(' | ')}`);
}

for (const [name, options] of [['desk', kDesk], ['phone', kPhone]]) {
  for (const colorScheme of ['light', 'dark']) {
    test(
        `nothing in the way of a screen reader: ${name}, ${colorScheme}`,
        () => visit(async (page) => {
          assert.deepEqual(await offences(page), []);
          await choose(page, 'tray');
          await page.locator('#pairs tr').first().waitFor();
          assert.deepEqual(await offences(page), []);
          await page.locator('.keys summary').click();
          await drop(page, [{name: 'what.zip', bytes: Buffer.from('PK')}]);
          await page.locator('#alert').waitFor();
          assert.deepEqual(await offences(page), []);
          await drop(page, [{name: 'scene.glb', bytes: triangleGlb()}]);
          await page.locator('#player').waitFor();
          assert.deepEqual(await offences(page), []);
        }, {...options, colorScheme}));
  }
}

test(
    'words are said once B rests, not while it moves',
    () => visit(async (page) => {
      // Uses a clock of its own, as the page's may be slow here.
      const said = await page.evaluate(() => {
        const {readouts, world} = playground, words = [];
        readouts.say = (text) => words.push(text);
        let now = performance.now() + 1e6;
        for (let i = 0; i < 600; ++i) {
          readouts.note(world.contact, now += 16);
          readouts.tick(now);
        }
        const meanwhile = words.length;
        for (let i = 0; i < 600; ++i) readouts.tick(now += 16);
        return {meanwhile, after: words.length - meanwhile};
      });
      assert.deepEqual(said, {meanwhile: 0, after: 1});
      // Nothing else speaks by itself.
      const speakers = await page.evaluate(
          () => [...document.querySelectorAll('output, [aria-live], [role=status], [role=alert]')]
                    .map(({id}) => id));
      assert.deepEqual(speakers, ['loading', 'alert', 'live']);
    }));

test(
    'Tab goes through the page in the order that is seen',
    () => visit(async (page) => {
      const order = [];
      for (let i = 0; i < 40; ++i) {
        await page.keyboard.press('Tab');
        const id = await page.evaluate(() => {
          const {activeElement: at} = document;
          return at === document.body ? null : at.id || at.value || at.textContent.trim();
        });
        if (id === null || order.includes(id)) break;
        order.push(id);
      }
      assert.deepEqual(order, [
        'view', 'theme', 'Guide', 'For your own page', 'Licence', 'pair', 'spheres', 'open', 'swap', 'translate', 'letgo', 'home', 'surface',
        'opacity-a', 'opacity-b', 'cut', 'arrows', 'patches', 'overlap', 'gap', 'Keys'
      ]);
    }));

test(
    'a finger drags B on a phone',
    () => visit(async (page) => {
      const before = await pose(page);
      const at = await handle(page);
      const fingers = await page.context().newCDPSession(page);
      const touch = (type, y) => fingers.send(
          'Input.dispatchTouchEvent',
          {type, touchPoints: type === 'touchEnd' ? [] : [{x: at[0], y}]});
      const camera = () => page.evaluate(() => playground.view.camera.position.toArray().join());
      const eye = await camera();
      await touch('touchStart', at[1]);
      for (let i = 1; i <= 8; ++i) {
        await touch('touchMove', at[1] - 5 * i);
        await page.waitForTimeout(50);
      }
      await touch('touchEnd');
      await page.waitForFunction(
          ([, , z]) => playground.world.contact.best &&
              playground.world.pose.translation[2] > z + 0.5,
          before.translation);
      const after = await pose(page);
      assert.deepEqual(after.translation.slice(0, 2), before.translation.slice(0, 2));
      assert.equal(await camera(), eye, 'the view stood still');
      assert.equal(await page.evaluate('scrollY'), 0);
      // Beside the handles a finger turns the view.
      await fingers.send(
          'Input.dispatchTouchEvent', {type: 'touchStart', touchPoints: [{x: 30, y: 60}]});
      await fingers.send(
          'Input.dispatchTouchEvent', {type: 'touchMove', touchPoints: [{x: 90, y: 60}]});
      await fingers.send('Input.dispatchTouchEvent', {type: 'touchEnd', touchPoints: []});
      await page.waitForFunction(
          (eye) => playground.view.camera.position.toArray().join() !== eye, eye);
      assert.deepEqual(await pose(page), after);
    }, kPhone));

test(
    'dark or light, and the choice stays',
    () => visit(async (page) => {
      const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
      const light = await ground();
      await page.locator('#theme').click();
      const dark = await ground();
      assert.notEqual(light, dark);
      await page.reload();
      assert.equal(await ground(), dark);
      await page.emulateMedia({colorScheme: 'light'});
      assert.equal(await ground(), dark);
    }));
