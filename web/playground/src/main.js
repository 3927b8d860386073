// The page: fetches pairs, wires buttons and sliders to the world, and runs its frames.

import {Asset, init} from 'ist-query';

import {acceptDrops, readFile} from './files.js';
import {whole} from './format.js';
import {Keys} from './keys.js';
import {Player} from './player.js';
import {Plot} from './plot.js';
import {Readouts} from './readouts.js';
import {colour, theme} from './theme.js';
import {View} from './view.js';
import {World} from './world.js';

const $ = (id) => document.getElementById(id);
const kOwn = 'own';  // the choice of pairs that stands for a visitor's files

function tell(message) {
  $('alert-told').textContent = message;
  $('alert').hidden = false;
}
function untell() {
  $('alert').hidden = true;
}
/** Runs what may fail; the page says why it did. */
async function attempt(act) {
  try {
    await act();
  } catch (error) {
    tell(error.message.replace(/^ist: /, ''));
  }
}

async function start() {
  const readouts = new Readouts($('readouts'), $('live'));
  const plots = {
    volume: new Plot($('plot-volume'), $('plot-volume-told'), 'u³'),
    force: new Plot($('plot-force'), $('plot-force-told'), 'u²'),
  };
  const view = new View($('view'));
  const world = new World(view, {
    asked: (contact) => readouts.note(contact, performance.now()),
    held: (free) => {
      $('letgo').setAttribute('aria-pressed', free);
      $('letgo').textContent = free ? 'Hold' : 'Let go';
    },
  });
  const player = new Player(
      {
        form: $('player'),
        play: $('play'),
        moment: $('moment'),
        told: $('moment-told'),
        leave: $('leave')
      },
      () => leavePlayer());
  theme($('theme'), () => world.recolour());

  // --- Solids

  await init();
  const {sphereCounts, pairs} = await fetched('demo/pairs.json', (answer) => answer.json());
  for (const {id, name} of pairs) $('pair').append(new Option(name, id));
  for (const count of sphereCounts) $('spheres').append(new Option(whole(count), count));
  let latest;
  async function choose() {
    const pair = pairs.find(({id}) => id === $('pair').value), count = $('spheres').value;
    if (!pair) return;
    leavePlayer();
    const mine = latest = {};
    $('loading').hidden = false;
    const names = [pair.a, pair.b];
    try {
      const bytes = await Promise.all(
          names.map((name) => fetched(`demo/${name}_${count}.ist`, (a) => a.arrayBuffer())));
      if (mine !== latest) return;
      hold(...bytes.map((b, k) => Asset.from(b, names[k])), names, pair);
      $('cut').value = 100 * (pair.cut ?? 0);
      $('cut').oninput();
    } finally {
      if (mine === latest) $('loading').hidden = true;
    }
  }
  function hold(a, b, names, how) {
    untell();
    world.hold(a, b, how);
    for (const plot of Object.values(plots)) plot.clear();
    tellNames(names);
    tellLevels();
  }
  function tellNames(names) {
    [$('name-a').textContent, $('name-b').textContent] =
        names.map((name, k) => `${'AB'[k]} ${name.replaceAll('_', ' ')}`);
    world.names = names;
    const [a, b] = [world.a.info, world.b.info];
    $('note').textContent =
        `A: ${whole(a.spheres)} spheres, ${(100 * a.coverage).toFixed(1)} % filled. ` +
        `B: ${whole(b.spheres)} spheres, ${(100 * b.coverage).toFixed(1)} % filled. ` +
        'u is the unit of the meshes; k is a pressure.';
  }
  $('pair').onchange = $('spheres').onchange = () => attempt(choose);
  $('swap').onclick = () => {
    if (!world.a) return;
    leavePlayer();
    world.swap();
    tellNames(world.names.toReversed());
    tellLevels();
  };

  // --- Files

  async function take(files) {
    untell();
    const read = [];
    try {
      for (const file of files) read.push(await readFile(file));
    } catch (error) {
      for (const {asset} of read) asset?.free();
      throw error;
    }
    const solids = read.filter(({kind}) => kind === 'solid');
    if (!world.a && solids.length !== 2) {
      throw new Error('There are no solids on the page yet: drop two .ist files at once.');
    }
    if (solids.length > 2) {
      for (const {asset} of solids) asset.free();
      throw new Error(`Two solids at a time: these are ${solids.length}.`);
    }
    if (solids.length > 0) {
      latest = {};  // what is on its way is not wanted any more
      $('loading').hidden = true;
      leavePlayer();
      const stem = (name) => name.replace(/\.[^.]+$/, '');
      // One alone is the new B.
      const a = solids.length === 2 ? solids[0].asset : world.a.asset;
      const b = solids.at(-1).asset;
      const names =
          [solids.length === 2 ? stem(solids[0].name) : world.names[0], stem(solids.at(-1).name)];
      hold(a, b, names, {pose: beside(a, b), up: solids.length === 2 ? 'z' : world.up});
      if (!$('pair').querySelector(`[value=${kOwn}]`))
        $('pair').append(new Option('Your files', kOwn));
      $('pair').value = kOwn;
    }
    for (const {geometry, name} of read.filter(({kind}) => kind === 'looks')) {
      // By name, else for B.
      const stem = name.toLowerCase().replace(/\.[^.]+$/, '');
      const ofA = world.names[0].toLowerCase() === stem && world.names[1].toLowerCase() !== stem;
      setMode('surface');
      world[ofA ? 'a' : 'b'].wear(geometry);
      view.dirty = true;
    }
    const scene = read.find(({kind}) => kind === 'scene');
    if (scene) enterPlayer(scene);
  }
  $('open').onclick = () => $('files').click();
  $('files').onchange = () => {
    const files = [...$('files').files];
    $('files').value = '';
    attempt(() => take(files));
  };
  acceptDrops($('drop'), (files) => attempt(() => take(files)));
  $('alert-close').onclick = untell;

  // --- Playback

  function enterPlayer(scene) {
    world.letGo(false);
    for (const solid of [world.a, world.b]) solid.group.visible = false;
    view.handles.detach();
    const {centre, radius} = player.start(scene, view.scene);
    view.frame(centre, radius, 'y');
    view.floor.visible = false;
    document.body.classList.add('playing');
  }
  function leavePlayer() {
    if (!player.open) return;
    player.stop();
    document.body.classList.remove('playing');
    for (const solid of [world.a, world.b]) solid.group.visible = true;
    view.handles.attach(world.b.group);
    world.frame();
  }

  // --- Settings

  const chosen = (name) => document.querySelector(`input[name=${name}]:checked`).value;
  function setMode(mode) {
    document.querySelector(`input[name=mode][value=${mode}]`).checked = true;
    world.show({mode, level: 0});
    tellLevels();
  }
  function tellLevels() {
    const levels = world.levels(), {mode} = world.settings, slider = $('level');
    slider.disabled = levels.length < 2;
    slider.max = Math.max(0, levels.length - 1);
    slider.value = world.settings.level;
    const [a, b] = levels[slider.value] ?? [];
    const text = mode === 'surface' ? '–' :
        a === b                     ? `${whole(a)} each` :
                                      `${whole(a)}, ${whole(b)}`;
    $('level-told').textContent = text;
    slider.setAttribute(
        'aria-valuetext',
        mode === 'surface' ? 'none' : `${text} ${mode === 'tree' ? 'balls' : 'spheres'}`);
  }
  $('mode').onchange = () => setMode(chosen('mode'));
  $('level').oninput = () => {
    world.show({level: Number($('level').value)});
    tellLevels();
  };
  for (const which of ['a', 'b']) {
    const slider = $(`opacity-${which}`);
    slider.oninput = () => {
      $(`opacity-${which}-told`).textContent = `${slider.value} %`;
      world.show({[`opacity${which.toUpperCase()}`]: slider.value / 100});
    };
  }
  $('cut').oninput = () => {
    const share = Number($('cut').value);
    $('cut-told').textContent = share === 0 ? 'off' : `${share} %`;
    world.show({cut: share / 100});
  };
  $('overlays').onchange = ({target}) => {
    world.overlays.shown[target.value] = target.checked;
    tellLegend();
    world.touched();
  };
  function tellLegend() {
    for (const [name, on] of Object.entries(world.overlays.shown)) {
      document.body.classList.toggle(name, on);
    }
  }
  tellLegend();
  const setHandles = (mode) => {
    document.querySelector(`input[name=gizmo][value=${mode}]`).checked = true;
    view.handles.setMode(mode);
  };
  $('gizmo').onchange = () => setHandles(chosen('gizmo'));
  const letGo = () => {
    leavePlayer();
    world.letGo(!world.free);
  };
  $('letgo').onclick = letGo;
  $('home').onclick = () => world.reset();
  new Keys(
      $('view'),
      () => ({right: view.right, up: view.up, near: view.near, radius: world.b.bounds.radius}), {
        move: (by) => world.move(by),
        turn: (by) => world.turn(by),
        handles: setHandles,
        letGo,
        home: () => world.reset(),
        read: () => readouts.say(readouts.words()),
        say: (words) => readouts.say(words),
      });

  // --- Frames

  let before = performance.now();
  function frame(now) {
    const seconds = Math.min(0.1, Math.max(0, now - before) / 1000);
    before = now;
    requestAnimationFrame(frame);
    try {
      go(seconds, now);
    } catch (error) {
      world.letGo(false);
      tell(error.message.replace(/^ist: /, ''));
    }
  }
  function go(seconds, now) {
    if (player.open) {
      if (player.advance(seconds)) view.dirty = true;
    } else {
      world.update(seconds);
      plotNow(now);
    }
    readouts.tick(now);
    view.render(player.open ? null : world.overlays);
  }
  function plotNow(now) {
    if (!world.contact?.penetration) return;
    const {volume, force} = world.contact.penetration;
    plots.volume.add(now, volume);
    plots.force.add(now, Math.hypot(...force));
    plots.volume.draw(now, colour('lens'));
    plots.force.draw(now, colour('force'));
  }

  // For the console, tests and pictures.
  window.playground = {world, view, player, readouts, setMode, choose};
  requestAnimationFrame(frame);
  await attempt(choose);
}

async function fetched(path, read) {
  let answer;
  try {
    answer = await fetch(path);
  } catch {
    throw new Error(`${path} cannot be fetched: is the server still there?`);
  }
  if (!answer.ok) throw new Error(`${path} cannot be fetched: ${answer.status}.`);
  return read(answer);
}

/** Right of A, a little apart. */
function beside(a, b) {
  const [boxA, boxB] = [a.bounds(), b.bounds()];
  return {
    rotation: [1, 0, 0, 0],
    translation: [
      boxA.upper[0] - boxB.lower[0] + 0.1 * boxB.radius,
      boxA.centre[1] - boxB.centre[1],
      boxA.centre[2] - boxB.centre[2],
    ],
  };
}

start().catch((error) => {
  $('loading').hidden = true;
  tell(error.message.replace(/^ist: /, ''));
});
