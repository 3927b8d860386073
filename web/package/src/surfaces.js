// Rays and points against one solid.

import {kInvalidInput} from './answers.js';
import {positive, writePose} from './desk.js';
import {IstError} from './error.js';
import {check, f64, functions, Room, u32} from './memory.js';
import {checkOptions} from './options.js';
import {solid} from './query.js';

// Numbers of an answer after its status and triangle, in the order of the header.
export const kHit = {distance: 1, point: 3, normal: 3};
export const kSurfacePoint = {distance: 1, error: 1, point: 3, gradient: 3};
const kRayBytes = 56, kPointBytes = 24;
const room = new Room();

function rows(given, what) {
  if (!(given?.length % 3 === 0))
    throw new IstError(`ist: ${what} has ${given?.length ?? 'no'} numbers; it must have three a row`);
  return given.length / 3;
}

function writeRow(place, given, row, what) {
  const numbers = f64();
  for (let k = 0; k < 3; ++k) {
    const value = given[3 * row + k];
    if (typeof value !== 'number') throw new IstError(`ist: ${what} holds ${value}, not a number`);
    numbers[place / 8 + k] = value;
  }
}

/** A single row that cannot be answered is an error; among many it is NaN. */
export function checkRows(status, count, who) {
  if (status !== kInvalidInput || count === 1) check(status, who);
}

function ask(question, who, given, pose, count, place, answers) {
  const wasm = functions(who), at = solid(given, 'A', who);
  writePose(0, pose, 'pose');
  checkRows(wasm[question](at, place, count, answers), count, who);
}

export function read(place, count, columns, out) {
  const numbers = f64(), integers = u32();
  let stride = 1, from = 1;
  for (const name in columns) stride += columns[name];
  out.count = count;
  if (!(out.triangle?.length >= count)) out.triangle = new Uint32Array(count);
  for (let i = 0; i < count; ++i) out.triangle[i] = integers[place / 4 + 2 * stride * i + 1];
  for (const name in columns) {
    const width = columns[name];
    if (!(out[name]?.length >= width * count)) out[name] = new Float64Array(width * count);
    for (let i = 0; i < count; ++i)
      for (let k = 0; k < width; ++k)
        out[name][width * i + k] = numbers[place / 8 + stride * i + from + k];
    from += width;
  }
  return out;
}

/** Writes rays, allocates a hit and `more` bytes for each; returns the addresses of rays and hits. */
export function askRays(who, origins, directions, options, more) {
  functions(who);
  checkOptions(who, options);
  const from = rows(origins, 'origins'), along = rows(directions, 'directions');
  if (from !== along && from !== 1 && along !== 1)
    throw new IstError(`ist: directions has ${along} rows; origins has ${from}`);
  const count = from === 1 ? along : from;
  const maxDistance = positive(options?.maxDistance ?? Infinity, 'maxDistance', Infinity);
  const place = room.of(count * (kRayBytes + 64 + more)), hits = place + count * kRayBytes;
  for (let i = 0; i < count; ++i) {
    const ray = place + i * kRayBytes;
    writeRow(ray, origins, from === 1 ? 0 : i, 'origins');
    writeRow(ray + 24, directions, along === 1 ? 0 : i, 'directions');
    f64()[ray / 8 + 6] = maxDistance;
  }
  return {place, count, hits, more: hits + 64 * count};
}

export function raycast(given, pose, origins, directions, options) {
  const {place, count, hits} = askRays('raycast()', origins, directions, options, 0);
  ask('raycast', 'raycast()', given, pose, count, place, hits);
  return read(hits, count, kHit, options?.into ?? {});
}

/** Writes points, allocates an answer of so many bytes for each; returns both addresses. */
export function placePoints(who, points, options, bytes) {
  functions(who);
  checkOptions(who, options);
  const count = rows(points, 'points');
  const place = room.of(count * (kPointBytes + bytes)), answers = place + count * kPointBytes;
  for (let i = 0; i < count; ++i) writeRow(place + i * kPointBytes, points, i, 'points');
  return {place, count, answers};
}

/** The same, and runs the query; returns the address of the answers. */
function askPoints(question, who, given, pose, points, options, bytes) {
  const {place, count, answers} = placePoints(who, points, options, bytes);
  ask(question, who, given, pose, count, place, answers);
  return answers;
}

export function closestPoint(given, pose, points, options) {
  const answers = askPoints('closest_point', 'closestPoint()', given, pose, points, options, 72);
  return read(answers, points.length / 3, kSurfacePoint, options?.into ?? {});
}

export function contains(given, pose, points, options) {
  const answers = askPoints('contains', 'contains()', given, pose, points, options, 4);
  const count = points.length / 3, out = options?.into ?? new Uint8Array(count);
  for (let i = 0; i < count; ++i) out[i] = u32()[answers / 4 + i];
  return out;
}
