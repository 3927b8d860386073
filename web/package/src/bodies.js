// Functions of existing answers, and of two assets whatever their pose.

import {codeOf, kPatchBytes, kWrench, newPenetration, newVectors, readPatches, readPenetration, readVectors, writePatch, writePenetration} from './answers.js';
import {Asset} from './asset.js';
import {desk, kMostPatches, positive, writeNumbers, writePose, writeSettings} from './desk.js';
import {IstError} from './error.js';
import {check, f64, functions, u32} from './memory.js';
import {checkOptions} from './options.js';

function two(a, b, who) {
  if (!(a instanceof Asset && b instanceof Asset))
    throw new IstError(`ist: ${who}: both solids must be Assets`);
}

function writePlaces(a, b, poseB, options, who) {
  two(a, b, who);
  checkOptions(who, options);
  writePose(0, options?.poseA, 'poseA');
  writePose(1, poseB, 'poseB');
}

export function withoutProtrusion(whole, a, b, poseB, options) {
  const wasm = functions('withoutProtrusion()');
  writePlaces(a, b, poseB, options, 'withoutProtrusion()');
  writePenetration(desk().penetration, whole);
  check(wasm.without_protrusion(a._at, b._at), 'withoutProtrusion()');
  return readPenetration(
      desk().penetration, codeOf(whole.status), options?.into ?? newPenetration());
}

export function patchesWithoutProtrusion(found, a, b, poseB, options) {
  const wasm = functions('patchesWithoutProtrusion()');
  writePlaces(a, b, poseB, options, 'patchesWithoutProtrusion()');
  writeSettings(options);
  const {patches, count} = found;
  if (!(count <= Math.min(kMostPatches, patches.length)))
    throw new IstError('ist: patchesWithoutProtrusion() takes the result of contactPatches()');
  for (let i = 0; i < count; ++i) writePatch(desk().patches + i * kPatchBytes, patches[i]);
  check(wasm.patches_without_protrusion(a._at, b._at, count), 'patchesWithoutProtrusion()');
  readPatches(desk().patches, count, found);
  return found;
}

export function sizeMatch(a, b, options) {
  const wasm = functions('sizeMatch()');
  two(a, b, 'sizeMatch()');
  checkOptions('sizeMatch()', options);
  writePose(0, {scale: positive(options?.scaleA ?? 1, 'scaleA')}, 'A');
  writePose(1, {scale: positive(options?.scaleB ?? 1, 'scaleB')}, 'B');
  check(wasm.size_match(a._at, b._at), 'sizeMatch()');
  const numbers = f64(), integers = u32(), at = desk().fit / 8 + 1;
  return {
    featureSizeA: numbers[at],
    featureSizeB: numbers[at + 1],
    ratio: numbers[at + 2],
    aIsCoarser: integers[2 * at + 6] !== 0,
    hasMesh: integers[2 * at + 7] !== 0,
    needsMesh: integers[2 * at + 8] !== 0,
    fits: integers[2 * at + 9] !== 0,
  };
}

const kOrigin = [0, 0, 0];

export function wrenches(contact, poseB, points, into) {
  const wasm = functions('wrenches()');
  checkOptions('wrenches()', points);
  writePose(1, poseB, 'poseB');
  const isPatch = contact.normal !== undefined;
  if (isPatch)
    writePatch(desk().patches, contact);
  else
    writePenetration(desk().penetration, contact);
  const numbers = f64(), at = desk().numbers / 8;
  writeNumbers(numbers, at, points?.a, kOrigin, 3, 'points.a');
  writeNumbers(numbers, at + 3, points?.b, kOrigin, 3, 'points.b');
  check(wasm.wrenches(isPatch ? 1 : 0), 'wrenches()');
  const out = into ?? {onA: newVectors(kWrench), onB: newVectors(kWrench)};
  const first = desk().wrenches / 8 + 1;
  readVectors(kWrench, first, out.onA);
  readVectors(kWrench, first + 6, out.onB);
  return out;
}
