// Bakes the pairs of solids that the page offers, and runs the scenes that it plays, into a folder
// that its build copies: node demo.js

import {execFileSync} from 'node:child_process';
import {copyFileSync, existsSync, mkdirSync, rmSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

import {baked, buildFolder, hasOracle, oracleMesh, root, sampleMesh, sharedMesh} from '../package/test/data.js';

/** The folder that the page fetches from. */
export const demoFolder = join(buildFolder, 'playground/public');
export const sphereCounts = [4000, 10000];

const kDragon = sharedMesh('dragon_174k.ply');

/**
 * Poses: quaternion w, x, y, z and translation [u]. `up`: against gravity, an axis of A's.
 */
const kPairs = [
  {
    id: 'bolt-nut',
    name: 'Bolt and nut',
    a: 'bolt',
    b: 'nut',
    pose: {rotation: [1, 0, 0, 0], translation: [0, 0, 8.5]},
    friction: 0.01,  // or the thread would hold it
  },
  ...(hasOracle ? [{
    id: 'elephant-dino',
    name: 'Elephant and dino',
    a: {name: 'elephant', mesh: oracleMesh('elephant')},
    b: {name: 'dino', mesh: oracleMesh('dino')},
    pose: {rotation: [0.5, -0.5, -0.5, -0.5], translation: [0.4, 0.03, 0.05]},
    up: 'y',
  }] :
                  []),
  {
    id: 'screw-table',
    name: 'Screw on a table',
    a: {name: 'slab', scale: 10},
    b: 'bolt',
    pose: {rotation: [0.70711, 0, 0.70711, 0], translation: [-10, 0, 8.6]},
  },
  kDragon ? {
    id: 'probe-dragon',
    name: 'Probe on a dragon',
    a: {name: 'dragon', mesh: kDragon},
    b: {name: 'capsule', scale: 0.02},
    pose: {rotation: [0.70711, 0.70711, 0, 0], translation: [-0.06, 0.2035, 0]},
    up: 'y',
  } :
            {
              id: 'probe-knot',
              name: 'Probe on a knot',
              a: 'torus_knot',
              b: {name: 'capsule', scale: 0.4},
              pose: {rotation: [1, 0, 0, 0], translation: [2.6, 0, 0.7]},
            },
  {
    id: 'gears',
    name: 'Two gears',
    a: 'gear',
    b: 'gear',
    pose: {rotation: [0.99518, 0, 0, 0.09802], translation: [9.05, 0, 0]},
  },
  {
    id: 'ball-shell',
    name: 'Ball in a shell',
    a: 'hollow_sphere',
    b: {name: 'sphere', scale: 0.3},
    pose: {rotation: [1, 0, 0, 0], translation: [0.3, 0, -0.54]},
    cut: 0.5,
  },
];
/**
 * Twenty parts: four gears in mesh, each on a bolt with a nut, of which the second stands too near
 * the first, and bolts and nuts beside them.
 */
function trayParts() {
  const kScale = 4.8, kApart = 9.65 * kScale;  // [u] the shafts: the teeth just clear
  const kUpright = [1, 0, 0, 0], kOnHead = [0, 1, 0, 0];
  const turned =
      (degrees) => [Math.cos(degrees * Math.PI / 360), 0, 0, Math.sin(degrees * Math.PI / 360)];
  const part = (solid, rotation, ...translation) => ({solid, pose: {rotation, translation}});
  const parts = [[0, 0], [kApart - 1.5, 0], [kApart, kApart], [0, kApart]].flatMap(
      ([x, y], i) =>
          [{...part('gear', turned(i % 2 ? 5.5 : 0), x, y, 5 + 0.8 * kScale), scale: kScale},
           part('bolt', kOnHead, x, y, 21),
           part('nut', kOnHead, x, y, 17),
  ]);
  for (let i = 0; i < 4; ++i) {
    parts.push(
        part('bolt', kOnHead, 22 * i - 10, -42, 21), part('nut', kUpright, 22 * i - 10, -64, 4));
  }
  return parts;
}
const kTrays = [{id: 'tray', name: 'Twenty parts on a tray', parts: trayParts()}];
/** Scenes of examples/bullet: write_scene runs them. */
const kScenes = [
  {id: 'nut', name: 'A nut turns down a bolt'},
  {id: 'bowl', name: 'A ball in a bowl in a box'},
];
export const sceneFile = (id) => join(buildFolder, `assets/${id}.glb`);

/** Files of the scenes, each run once. */
function runScenes() {
  const meshes = join(buildFolder, 'assets');
  for (const name of ['bolt', 'nut']) sampleMesh(name);
  for (const {id} of kScenes) {
    if (existsSync(sceneFile(id))) continue;
    execFileSync(
        join(root, 'build/bin/write_scene'), [id, '--meshes', meshes, '--glb', sceneFile(id)],
        {stdio: 'ignore'});
  }
}

/** Every asset at every count: paths by name and count. */
export function bakeDemo() {
  rmSync(demoFolder, {recursive: true, force: true});
  mkdirSync(join(demoFolder, 'demo'), {recursive: true});
  runScenes();
  for (const {id} of kScenes) copyFileSync(sceneFile(id), join(demoFolder, `demo/${id}.glb`));
  const file = (solid, spheres) => {
    const {name, ...options} = typeof solid === 'string' ? {name: solid} : solid;
    const path = baked(name, spheres, options);
    copyFileSync(path, join(demoFolder, 'demo', `${name}_${spheres}.ist`));
    return name;
  };
  const pairs = kPairs.map((pair) => {
    let names;
    for (const spheres of sphereCounts) names = [pair.a, pair.b].map((s) => file(s, spheres));
    return {...pair, a: names[0], b: names[1]};
  });
  for (const {solid} of kTrays.flatMap(({parts}) => parts)) file(solid, sphereCounts[0]);
  writeFileSync(
      join(demoFolder, 'demo/pairs.json'),
      JSON.stringify({sphereCounts, pairs, trays: kTrays, scenes: kScenes}, null, 2) + '\n');
}

if (process.argv[1] === import.meta.filename) bakeDemo();
