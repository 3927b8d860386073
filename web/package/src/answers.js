// Answers as objects, and the bytes that they stand for.

import {copy3} from './desk.js';
import {f64, u32} from './memory.js';

export const newVector = () => new Float64Array(3);

export const kInvalidInput = -1;  // IST_INVALID_INPUT
export const kNotHeld = -15;      // IST_NOT_HELD
const kErrorExceeded = 2;         // IST_ERROR_EXCEEDED

export const statusOf = (status) => status === 0 ? 'ok' :
    status === 1                                 ? 'budget-exhausted' :
    status === kErrorExceeded                    ? 'error-exceeded' :
    status === kNotHeld                          ? 'not-held' :
                                                   'invalid-input';

/** Of an answer, which is one. */
export const codeOf = (status) => status === 'budget-exhausted' ? 1 :
    status === 'error-exceeded'                                 ? kErrorExceeded :
                                                                  0;

export const newPenetration = () => ({
  status: 'ok',
  volume: 0,
  volumeMin: 0,
  volumeMax: 0,
  centroid: newVector(),
  force: newVector(),
  torque: newVector(),
  nodeVisits: 0,
  spherePairs: 0,
});

/** Bytes of an ist_penetration_t. */
export const kPenetrationBytes = 112;

/** `place`: bytes from the start of memory. */
export function readPenetration(place, status, out) {
  const numbers = f64(), integers = u32(), at = place / 8 + 1;
  out.status = statusOf(status);
  out.volume = numbers[at];
  out.volumeMin = numbers[at + 1];
  out.volumeMax = numbers[at + 2];
  copy3(numbers, at + 3, out.centroid);
  copy3(numbers, at + 6, out.force, -1);
  copy3(numbers, at + 9, out.torque, -1);
  out.nodeVisits = integers[2 * at + 24];
  out.spherePairs = integers[2 * at + 25];
  return out;
}

/** Puts an answer back where the library looks for it. */
export function writePenetration(place, answer) {
  const numbers = f64(), integers = u32(), at = place / 8 + 1;
  integers[2 * at - 1] = codeOf(answer.status);
  numbers[at] = answer.volume;
  numbers[at + 1] = answer.volumeMin;
  numbers[at + 2] = answer.volumeMax;
  write3(answer.centroid, numbers, at + 3);
  write3(answer.force, numbers, at + 6, -1);
  write3(answer.torque, numbers, at + 9, -1);
  integers[2 * at + 24] = answer.nodeVisits;
  integers[2 * at + 25] = answer.spherePairs;
}

function write3(from, to, at, sign = 1) {
  to[at] = sign * from[0];
  to[at + 1] = sign * from[1];
  to[at + 2] = sign * from[2];
}

export const newPatch = () => ({
  id: 0,
  centroid: newVector(),
  normal: newVector(),
  area: 0,
  depth: 0,
  volume: 0,
  force: newVector(),
  torque: newVector(),
  point: newVector(),
  twist: 0,
});

/** Bytes of an ist_contact_patch_t. */
export const kPatchBytes = 160;

export function readPatch(place, patch) {
  const numbers = f64(), integers = u32(), at = place / 8;
  // Exact below 2⁵³, which is what assets that fit into 32 bits of addresses stay under.
  patch.id = integers[2 * at] + 2 ** 32 * integers[2 * at + 1];
  copy3(numbers, at + 1, patch.centroid);
  copy3(numbers, at + 4, patch.normal);
  patch.area = numbers[at + 7];
  patch.depth = numbers[at + 8];
  patch.volume = numbers[at + 9];
  copy3(numbers, at + 10, patch.force);
  copy3(numbers, at + 13, patch.torque);
  copy3(numbers, at + 16, patch.point);
  patch.twist = numbers[at + 19];
}

export function writePatch(place, patch) {
  const numbers = f64(), integers = u32(), at = place / 8;
  integers[2 * at] = patch.id % 2 ** 32;
  integers[2 * at + 1] = Math.floor(patch.id / 2 ** 32);
  write3(patch.centroid, numbers, at + 1);
  write3(patch.normal, numbers, at + 4);
  numbers[at + 7] = patch.area;
  numbers[at + 8] = patch.depth;
  numbers[at + 9] = patch.volume;
  write3(patch.force, numbers, at + 10);
  write3(patch.torque, numbers, at + 13);
  write3(patch.point, numbers, at + 16);
  numbers[at + 19] = patch.twist;
}

export const newPatches = () => ({whole: newPenetration(), count: 0, patches: []});

export function readPatches(place, count, out) {
  out.count = count;
  for (let i = 0; i < count; ++i) readPatch(place + i * kPatchBytes, out.patches[i] ??= newPatch());
}
