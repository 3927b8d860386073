// The content of the page: the pairs, parts and scenes that it offers, and a visitor's own.

import {Asset} from 'ist-query';

import {$, untell} from './dom.js';
import {readFile} from './files.js';
import {whole} from './format.js';

const kOwn = 'own';  // the choice that stands for a visitor's files

const stem = (name) => name.replace(/\.[^.]+$/, '');

export class Library {
  /** `on.held`: what to call when solids were taken. */
  constructor({world, tray, view, player, settings}, on) {
    Object.assign(this, {world, tray, view, player, settings, on});
    this.stage = world;  // or the tray, or the player
    $('swap').onclick = () => {
      if (!world.a) return;
      this.enter(this.world);
      world.swap();
      this.tellNames(world.names.toReversed());
      settings.tellLevels();
    };
  }

  async open() {
    const {sphereCounts, pairs, trays, scenes} =
        await fetched('demo/pairs.json', (answer) => answer.json());
    this.sphereCounts = sphereCounts;
    this.pairs = pairs;
    this.trays = trays;
    this.scenes = scenes;
    const group = (label, entries) => {
      const made = Object.assign(document.createElement('optgroup'), {label});
      made.append(...entries.map(({id, name}) => new Option(name, id)));
      if (entries.length > 0) $('pair').append(made);
    };
    group('Solids', pairs);
    group('Many parts', trays);
    group('Scenes from Bullet', scenes);
    for (const count of sphereCounts) $('spheres').append(new Option(whole(count), count));
  }

  /** Shows the chosen item. Earlier choices that arrive later are dropped. */
  async choose() {
    const id = $('pair').value, mine = this.latest = {};
    const [pair, tray, scene] =
        [this.pairs, this.trays, this.scenes].map((all) => all.find((one) => one.id === id));
    if (!pair && !tray && !scene) return;
    $('loading').hidden = false;
    try {
      if (scene) {
        const bytes = await fetched(`demo/${id}.glb`, (answer) => answer.arrayBuffer());
        const read = await readFile(new File([bytes], `${id}.glb`));
        if (mine === this.latest) this.enterScene({...read, name: scene.name});
        return;
      }
      const names = tray ? [...new Set(tray.parts.map(({solid}) => solid))] : [pair.a, pair.b];
      const count = tray ? this.sphereCounts[0] : $('spheres').value;  // exact, the fewest will do
      const bytes = await Promise.all(names.map(
          (name) => fetched(`demo/${name}_${count}.ist`, (answer) => answer.arrayBuffer())));
      if (mine !== this.latest) return;
      const assets = bytes.map((b, k) => Asset.from(b, names[k]));
      if (tray) {
        untell();
        this.enter(this.world);  // leaves the parts that were there
        this.tray.hold(Object.fromEntries(names.map((name, k) => [name, assets[k]])), tray.parts);
        this.enter(this.tray);
        return;
      }
      this.enter(this.world);
      this.hold(...assets, names, pair);
      this.settings.setCut(pair.cut ?? 0);
    } finally {
      if (mine === this.latest) $('loading').hidden = true;
    }
  }

  hold(a, b, names, how) {
    untell();
    this.world.hold(a, b, how);
    this.tellNames(names);
    this.settings.tellLevels();
    this.on.held();
  }

  tellNames(names) {
    const {world} = this;
    [$('name-a').textContent, $('name-b').textContent] =
        names.map((name, k) => `${'AB'[k]} ${name.replaceAll('_', ' ')}`);
    world.names = names;
    const [a, b] = [world.a.info, world.b.info];
    $('note').textContent =
        `A: ${whole(a.spheres)} spheres, ${(100 * a.coverage).toFixed(1)} % filled. ` +
        `B: ${whole(b.spheres)} spheres, ${(100 * b.coverage).toFixed(1)} % filled.`;
  }

  // --- A visitor's files

  async take(files) {
    untell();
    const read = [];
    try {
      for (const file of files) read.push(await readFile(file));
      this.check(read.map(({kind}) => kind));
    } catch (error) {
      for (const {asset} of read) asset?.free();
      throw error;
    }
    this.takeSolids(read.filter(({kind}) => kind === 'solid'));
    const scene = read.find(({kind}) => kind === 'scene');
    if (!scene) return;
    this.latest = {};
    $('loading').hidden = true;
    this.chooseOwn();
    this.enterScene(scene);
  }

  /** Throws if files of these kinds cannot be shown together. */
  check(kinds) {
    const solids = kinds.filter((kind) => kind === 'solid').length;
    if (solids > 2) throw new Error(`Two solids at a time: these are ${solids}.`);
    if (!this.world.a && solids < 2 && kinds.some((kind) => kind !== 'scene'))
      throw new Error('There are no solids on the page yet: drop two .ist files at once.');
  }

  takeSolids(solids) {
    const {world} = this;
    if (solids.length === 0) return;
    this.latest = {};  // pending items are no longer wanted
    $('loading').hidden = true;
    this.enter(this.world);
    // One alone is the new B.
    const a = solids.length === 2 ? solids[0].asset : world.a.asset, b = solids.at(-1).asset;
    const names = [
      solids.length === 2 ? stem(solids[0].name) : world.names[0],
      stem(solids.at(-1).name),
    ];
    this.hold(a, b, names, {pose: beside(a, b), up: solids.length === 2 ? 'z' : world.up});
    this.chooseOwn();
  }

  chooseOwn() {
    if (!$('pair').querySelector(`[value=${kOwn}]`))
      $('pair').append(new Option('Your files', kOwn));
    $('pair').value = kOwn;
  }

  // --- The stage

  /** Puts the world, the tray or the player on the stage. */
  enter(stage) {
    const {world, tray, player} = this;
    if (stage === this.stage) return;
    if (this.stage === player)
      player.stop();
    else
      this.stage.setVisible(false);
    this.stage = stage;
    world.letGo(false);
    document.body.classList.toggle('playing', stage === player);
    document.body.classList.toggle('tray', stage === tray);
    this.tellStage();
    if (!stage.b) return;
    stage.setVisible(true);
    stage.frame();
  }

  tellStage() {
    const {stage, world, tray} = this, many = stage === tray;
    $('hint').textContent = many ? 'Drag any part. Drag beside them to look around.' :
                                   'Drag an arrow to push B into A. Drag beside it to look around.';
    $('view').setAttribute(
        'aria-label',
        many ? `${tray.solids.length} parts. Arrow keys move the part in hand, N takes the next.` :
               'Solids A and B. Arrow keys move B.');
    $('motion-title').textContent = many ? 'Part in hand' : 'B';
    if (many) {
      document.body.classList.remove('moved');
      $('name-a').textContent = 'parts';
      $('part').replaceChildren(...tray.solids.map(({name}) => new Option(name)));
      this.tellTaken(tray.b);
    } else if (world.names) {
      this.tellNames(world.names);
    }
  }

  /** A part that was taken in hand. */
  tellTaken({name}) {
    $('part').value = $('name-b').textContent = name;
  }

  // --- Playback

  enterScene(scene) {
    const {view, player} = this;
    this.enter(player);
    const {centre, radius} = player.start(scene, view.scene);
    view.frame(centre, radius, 'y');
    if (view.floor) view.floor.visible = false;
  }

  /** Back to the solids that were there, or to the first pair. */
  async backToSolids() {
    this.enter(this.world);
    const held =
        this.pairs.find(({a, b}) => this.world.names?.[0] === a && this.world.names[1] === b);
    if (held) {
      $('pair').value = held.id;
    } else if (this.world.a) {
      this.chooseOwn();
    } else {
      $('pair').value = this.pairs[0].id;
      await this.choose();
    }
  }
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
