// Data of the tests and the benchmark: assets baked with build/bin/ist, and tables of poses.

import {execFileSync} from 'node:child_process';
import {existsSync, mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';

export const root = fileURLToPath(new URL('../../..', import.meta.url));
export const buildFolder = join(root, 'build-web');
export const packageFolder = join(root, 'web/package');
export const program = join(root, 'build/bin/ist');
const nativeRows = join(root, 'build/bin/native_rows');
const shared = resolve(process.env.IST_SHARED ?? join(root, '../shared'));

/** A sample's mesh: its path. */
export function sampleMesh(name) {
  const path = join(buildFolder, `assets/${name}.obj`);
  mkdirSync(join(buildFolder, 'assets'), {recursive: true});
  if (!existsSync(path)) execFileSync(program, ['sample', name, '-o', path], {stdio: 'ignore'});
  return path;
}

/** A sample, or a mesh, as an asset, larger by a factor: its path. Baked once. */
export function baked(name, spheres, {mesh, scale = 1, keepMesh = true} = {}) {
  const folder = join(buildFolder, 'assets');
  const path = join(
      folder,
      `${name}${scale === 1 ? '' : `_x${scale}`}_${spheres}${keepMesh ? '' : '_bare'}.ist`);
  if (existsSync(path)) return path;
  mkdirSync(folder, {recursive: true});
  mesh ??= sampleMesh(name);
  execFileSync(
      program,
      ['bake', mesh, '-o', path, '--spheres', spheres, '--scale', scale, '--keep-mesh', keepMesh ? 'yes' : 'no',
       '--device', 'cpu'],
      {stdio: 'ignore'});
  return path;
}

/** The nut on the bolt: along and off the thread, turned and tilted. */
function nutPoses() {
  const path = join(buildFolder, 'assets/bolt_nut.csv');
  if (existsSync(path)) return path;
  const lines = ['id,class,meshA,meshB,qw,qx,qy,qz,tx,ty,tz,scale_b'];
  for (let i = 0; i < 60; ++i) {
    const turn = 0.05 * i, tilt = 0.02 * (i % 5);
    const q = [
      Math.cos(turn) * Math.cos(tilt), Math.cos(turn) * Math.sin(tilt), 0.01 * (i % 3),
      Math.sin(turn)
    ];
    const size = Math.hypot(...q);
    lines.push([
      i, 'nut', 'bolt', 'nut', ...q.map((x) => x / size), 0.3 * (i % 7), 0.1 * (i % 4),
      6 + 0.15 * i, 1
    ].join());
  }
  writeFileSync(path, lines.join('\n') + '\n');
  return path;
}

/** True if the oracle's tables exist. */
export const hasOracle = existsSync(join(shared, 'oracle'));
/** A mesh of the shared data; undefined if it does not exist. */
export function sharedMesh(name) {
  const path = join(shared, 'meshes/dev', name);
  return existsSync(path) ? path : undefined;
}
export const oracleMesh = (name) => join(shared, `oracle/meshes/${name}.off`);

/** Pairs of assets and their tables; those of the shared data where there are any. */
export function pairs(spheres = 4000) {
  const made = [
    {name: 'bolt and nut', a: baked('bolt', spheres), b: baked('nut', spheres), csv: nutPoses()}
  ];
  if (hasOracle) {
    const oracle = (name) => baked(name, spheres, {mesh: oracleMesh(name)});
    made.push({
      name: 'elephant and dino',
      a: oracle('elephant'),
      b: oracle('dino'),
      csv: join(shared, 'oracle/poses/poses_eledino.csv')
    });
    made.push({
      name: 'table and small dino',
      a: oracle('table'),
      b: oracle('dino'),
      csv: join(shared, 'oracle/small/small_table_dino.csv')
    });
  } else if (process.env.IST_REQUIRE_SHARED === '1') {
    throw new Error(`no oracle in ${shared}, and IST_REQUIRE_SHARED=1 demands it`);
  }
  return made;
}

/** The native library's answers and times [µs]. */
export function nativeAnswers({a, b, csv}) {
  return execFileSync(nativeRows, [a, b, csv], {encoding: 'utf8', maxBuffer: 1 << 28});
}
export function nativeTimes({a, b, csv}, passes) {
  return JSON.parse(execFileSync(nativeRows, [a, b, csv, '--time', passes], {encoding: 'utf8'}));
}

/** The first line in which two answers differ, for a message. */
export function firstDifference(wanted, got) {
  const lines = got.split('\n');
  const i = wanted.split('\n').findIndex((line, k) => line !== lines[k]);
  return i < 0 ? null : {native: wanted.split('\n')[i], here: lines[i]};
}

export const read = (path) => readFileSync(path);
