// The page: puts its parts together and runs its frames.

import {init} from 'ist-query';

import {$, attempt, tell, untell} from './dom.js';
import {Drag} from './drag.js';
import {acceptDrops} from './files.js';
import {Keys} from './keys.js';
import {Library} from './library.js';
import {Pairs} from './pairs.js';
import {Player} from './player.js';
import {Plot} from './plot.js';
import {Readouts} from './readouts.js';
import {Settings} from './settings.js';
import {colour, theme} from './theme.js';
import {Tray} from './tray.js';
import {View} from './view.js';
import {World} from './world.js';

async function start() {
  const readouts = new Readouts($('readouts'), $('live'));
  const plots = {
    volume: new Plot($('plot-volume'), $('plot-volume-told'), 'u³'),
    force: new Plot($('plot-force'), $('plot-force-told'), 'u²'),
  };
  const view = new View($('view'));
  const moved = () => document.body.classList.add('moved');
  const world = new World(view, {
    asked: (contact) => readouts.note(contact, performance.now()),
    timed: (contact) => readouts.noteTimes(contact),
    moved,
    held: (free) => $('letgo').setAttribute('aria-pressed', free),
  });
  const pairs = new Pairs($('pairs'), $('read-step'), $('live'));
  const tray = new Tray(view, {
    asked: () => pairs.note(tray, performance.now()),
    timed: () => pairs.noteTimes(tray),
    moved,
    taken: (solid) => library.tellTaken(solid),
  });
  const settings = new Settings(world, view);
  const player = new Player(
      {
        form: $('player'),
        play: $('play'),
        moment: $('moment'),
        told: $('moment-told'),
        facts: $('scene-facts'),
        leave: $('leave')
      },
      () => attempt(() => library.backToSolids()));
  const library = new Library({world, tray, view, player, settings}, {
    held: () => {
      for (const plot of Object.values(plots)) plot.clear();
    },
  });
  theme($('theme'), () => {
    world.recolour();
    tray.recolour();
  });

  await init();
  await library.open();
  $('pair').onchange = $('spheres').onchange = () => attempt(() => library.choose());

  $('open').onclick = () => $('files').click();
  $('files').onchange = () => {
    const files = [...$('files').files];
    $('files').value = '';
    attempt(() => library.take(files));
  };
  acceptDrops($('drop'), (files) => attempt(() => library.take(files)));
  $('alert-close').onclick = () => {
    untell();
    $('view').focus();
  };

  const letGo = () => {
    library.enter(world);
    world.letGo(!world.free);
  };
  $('letgo').onclick = letGo;
  $('home').onclick = () => library.stage.reset();
  const told = () => library.stage === tray ? pairs : readouts;
  new Keys(
      $('view'),
      () => (
          {right: view.right, up: view.up, near: view.near, radius: library.stage.b.bounds.radius}),
      {
        ready: () => library.stage.b !== undefined,
        move: (by) => library.stage.move(by),
        turn: (by) => library.stage.turn(by),
        handles: (mode) => settings.setHandles(mode),
        letGo: () => library.stage === world && letGo(),
        home: () => library.stage.reset(),
        read: () => told().say(told().words()),
        next: (by) => {
          if (library.stage !== tray) return;
          tray.next(by);
          told().say(`${tray.b.name} in hand.`);
        },
        say: (words) => told().say(words),
      });
  let under;
  new Drag(view, {
    ready: () => library.stage === tray,
    pick: (ray) => (under = tray.pick(ray))?.at,
    take: () => tray.take(under.solid),
    move: (by) => tray.move(by),
  });
  $('part').onchange = () => tray.take(tray.solids[$('part').selectedIndex]);

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
      tell(error);
    }
  }
  function go(seconds, now) {
    if (library.stage === player) {
      if (player.advance(seconds)) view.dirty = true;
    } else {
      library.stage.update(seconds);
      if (library.stage === world) plotNow(now);
      told().tick(now);
    }
    view.render(library.stage.overlays);
  }
  function plotNow(now) {
    if (!world.contact?.best) return;
    const {volume, force} = world.contact.best;
    plots.volume.add(now, volume);
    plots.force.add(now, Math.hypot(...force));
    plots.volume.draw(now, colour('overlap'));
    plots.force.draw(now, colour('force'));
  }

  // For the console, tests and pictures.
  window.playground = {
    world,
    tray,
    view,
    player,
    readouts,
    setMode: (mode) => settings.setMode(mode),
    choose: () => library.choose(),
  };
  requestAnimationFrame(frame);
  await attempt(() => library.choose());
}

start().catch((error) => {
  $('loading').hidden = true;
  tell(error);
});
