// The desk of src/exports.c: the memory for arguments and answers.

import {IstError} from './error.js';
import {f64, functions, u32} from './memory.js';

export const kMostPatches = 32;

// In the order of places().
const kParts = [
  'a', 'b', 'settings', 'penetration', 'separation', 'info', 'bounds', 'mass', 'impactSettings',
  'impact', 'fit', 'wrenches', 'motionA', 'motionB', 'patches', 'counts', 'numbers'
];
let parts = null;
/** The address of each part of the desk: bytes from the start of memory. */
export function desk() {
  if (parts === null) {
    const at = (functions('a query').places() >>> 0) / 4;
    parts = Object.fromEntries(kParts.map((name, i) => [name, u32()[at + i]]));
  }
  return parts;
}

// Names are concatenated only for errors, so that a loop creates no garbage.

const named = (what, part) => part === undefined ? what : `${what}.${part}`;

function number(value, what, part) {
  if (typeof value !== 'number')
    throw new IstError(`ist: ${named(what, part)} is ${value}, not a number`);
  return value;
}

/** Writes `count` numbers, or `absent` if none are given. */
export function writeNumbers(out, at, given, absent, count, what, part) {
  if (given === undefined || given === null) given = absent;
  if (given.length !== count)
    throw new IstError(`ist: ${named(what, part)} has ${given.length ?? 'no'} numbers, not ${count}`);
  for (let i = 0; i < count; ++i) out[at + i] = number(given[i], what, part);
}

/** Throws a TypeError for a member of `given` that is not in `members`: it is misspelt. */
export function checkMembers(given, members, what) {
  if (given === undefined || given === null) return;
  if (typeof given !== 'object') throw new TypeError(`ist: ${what} is ${given}, not an object`);
  for (const name in given)
    if (!members.includes(name))
      throw new TypeError(`ist: ${what}: no member is called ${name}; there are ${members.join(', ')}`);
}

export const kPose = ['rotation', 'translation', 'scale'];
const kIdentity = [1, 0, 0, 0];
const kOrigin = [0, 0, 0];

/** Writes pose A (0) or B (1). */
export function writePose(which, pose, what) {
  if (which === 1 && (pose === undefined || pose === null))
    throw new IstError(`ist: ${what} is missing: {rotation, translation, scale}`);
  writePoseAt(which === 0 ? desk().a : desk().b, pose, what);
}

/** The same at any address. */
export function writePoseAt(place, pose, what) {
  checkMembers(pose, kPose, what);
  const out = f64(), at = place / 8;
  writeNumbers(out, at, pose?.rotation, kIdentity, 4, what, 'rotation');
  writeNumbers(out, at + 4, pose?.translation, kOrigin, 3, what, 'translation');
  const scale = number(pose?.scale ?? 1, what, 'scale');
  if (!(scale > 0)) throw new IstError(`ist: ${what}.scale is ${scale}; it must be > 0`);
  out[at + 7] = scale;
}

function choice(value, names, what) {
  const i = value === undefined ? 0 : names.indexOf(value);
  if (i < 0) throw new IstError(`ist: ${what} is ${value}; use one of ${names.join(', ')}`);
  return i;
}

export function count(value, absent, what, least = 0, most = 0xffffffff) {
  if (value === undefined) return absent;
  if (!(Number.isInteger(value) && value >= least && value <= most))
    throw new IstError(
        `ist: ${what} is ${value}; it must be a whole number from ${least} to ` +
        (most === 0xffffffff ? '2³² − 1' : most));
  return value;
}

const kSphereMeasures = ['matched', 'inner'];
const kMeasures = [...kSphereMeasures, 'exact'];

/** A number > 0 and, unless `most` is given, finite. */
export function positive(value, what, most = Number.MAX_VALUE) {
  if (!(typeof value === 'number' && value > 0 && value <= most))
    throw new IstError(`ist: ${what} is ${value}; it must be > 0`);
  return value;
}

/** A number ≥ 0. */
export function notNegative(value, what) {
  if (!(number(value, what) >= 0)) throw new IstError(`ist: ${what} is ${value}; it must be ≥ 0`);
  return value;
}

/** For functions that return spheres. */
export function sphereMeasureOf(value) {
  return choice(value, kSphereMeasures, 'measure');
}

/** Writes all settings in the options. */
export function writeSettings(options) {
  const integers = u32();
  const at = desk().settings / 4;
  integers[at + 1] = choice(options?.measure, kMeasures, 'measure');
  integers[at + 2] = options?.spheresOnly ? 1 : 0;
  integers[at + 3] = count(options?.pairBudget, 0, 'pairBudget');
  integers[at + 4] = count(options?.maxVisits, 0, 'maxVisits');
  integers[at + 5] = count(options?.pairId, 0, 'pairId');
  f64()[at / 2 + 3] = notNegative(options?.relativeError ?? 0, 'relativeError');
}

/** Copies three numbers, which is shorter than set() and makes no view. */
export function copy3(from, at, to, place = 0) {
  for (let k = 0; k < 3; ++k) to[place + k] = from[at + k];
}
