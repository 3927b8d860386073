// Conversion of answers between objects and bytes.

import {copy3} from './desk.js';
import {f64, u32} from './memory.js';

export const kInvalidInput = -1;  // IST_INVALID_INPUT
export const kMissingData = -15;  // IST_MISSING_DATA
const kErrorExceeded = 2;         // IST_ERROR_EXCEEDED

export const statusOf = (status) => status === 0 ? 'ok' :
    status === 1                                 ? 'budget-exhausted' :
    status === kErrorExceeded                    ? 'error-exceeded' :
    status === kMissingData                      ? 'missing-data' :
                                                   'invalid-input';

/** The status code of a valid answer. */
export const codeOf = (status) => status === 'budget-exhausted' ? 1 :
    status === 'error-exceeded'                                 ? kErrorExceeded :
                                                                  0;

// Offsets of the vectors in answers, in numbers.
// Scalars are read one by one: a table of them would create garbage.
const kPenetration = {centroid: 3, force: 6, torque: 9, contactNormal: 13};
const kPatch = {centroid: 1, normal: 4, force: 10, torque: 13, point: 16};
const kGap = {pointA: 3, pointB: 6, normal: 9};
export const kMotion = {velocity: 0, angularVelocity: 3, about: 6};
export const kWrench = {force: 0, torque: 3};

export function newVectors(table) {
  const made = {};
  for (const name in table) made[name] = new Float64Array(3);
  return made;
}

export function readVectors(table, at, out) {
  const numbers = f64();
  for (const name in table) copy3(numbers, at + table[name], out[name]);
  return out;
}

function writeVectors(table, at, answer) {
  const numbers = f64();
  for (const name in table) copy3(answer[name], 0, numbers, at + table[name]);
}

export const newPenetration = () => ({
  status: 'ok',
  volume: 0,
  volumeMin: 0,
  volumeMax: 0,
  ...newVectors(kPenetration),
  touching: false,
  contactArea: 0,
  nodeVisits: 0,
  spherePairs: 0,
});

/** Bytes of an ist_penetration_t. */
export const kPenetrationBytes = 152;

/** `place`: bytes from the start of memory. */
export function readPenetration(place, status, out) {
  const numbers = f64(), integers = u32(), at = place / 8 + 1;
  out.status = statusOf(status);
  out.volume = numbers[at];
  out.volumeMin = numbers[at + 1];
  out.volumeMax = numbers[at + 2];
  out.contactArea = numbers[at + 12];
  out.nodeVisits = integers[2 * at + 32];
  out.spherePairs = integers[2 * at + 33];
  out.touching = integers[2 * at + 34] !== 0;
  return readVectors(kPenetration, at, out);
}

/** Writes an answer to where the library reads it. */
export function writePenetration(place, answer) {
  const numbers = f64(), integers = u32(), at = place / 8 + 1;
  integers[2 * at - 1] = codeOf(answer.status);
  numbers[at] = answer.volume;
  numbers[at + 1] = answer.volumeMin;
  numbers[at + 2] = answer.volumeMax;
  numbers[at + 12] = answer.contactArea;
  integers[2 * at + 32] = answer.nodeVisits;
  integers[2 * at + 33] = answer.spherePairs;
  integers[2 * at + 34] = answer.touching ? 1 : 0;
  writeVectors(kPenetration, at, answer);
}

/** The common members of a separation and an impact: the gap, and where it is. */
export const newGap = () => ({distanceMin: 0, distanceMax: 0, ...newVectors(kGap), nodeVisits: 0});

/** `at`: doubles from the start of memory to the number before the gap. */
export function readGap(at, out) {
  out.distanceMin = f64()[at + 1];
  out.distanceMax = f64()[at + 2];
  return readVectors(kGap, at, out);
}

export const newPatch =
    () => ({id: 0, ...newVectors(kPatch), area: 0, depth: 0, volume: 0, torsion: 0});

/** Bytes of an ist_contact_patch_t. */
export const kPatchBytes = 160;

export function readPatch(place, patch) {
  const numbers = f64(), integers = u32(), at = place / 8;
  // Exact below 2⁵³, which ids of assets in a 32-bit address space do not reach.
  patch.id = integers[2 * at] + 2 ** 32 * integers[2 * at + 1];
  patch.area = numbers[at + 7];
  patch.depth = numbers[at + 8];
  patch.volume = numbers[at + 9];
  patch.torsion = numbers[at + 19];
  readVectors(kPatch, at, patch);
}

export function writePatch(place, patch) {
  const numbers = f64(), integers = u32(), at = place / 8;
  integers[2 * at] = patch.id % 2 ** 32;
  integers[2 * at + 1] = Math.floor(patch.id / 2 ** 32);
  numbers[at + 7] = patch.area;
  numbers[at + 8] = patch.depth;
  numbers[at + 9] = patch.volume;
  numbers[at + 19] = patch.torsion;
  writeVectors(kPatch, at, patch);
}

export const newPatches = () => ({whole: newPenetration(), count: 0, patches: []});

export function readPatches(place, count, out) {
  out.count = count;
  for (let i = 0; i < count; ++i) readPatch(place + i * kPatchBytes, out.patches[i] ??= newPatch());
}
