// The queries.

import {newGap, newPatches, newPenetration, readGap, readPatches, readPenetration, statusOf} from './answers.js';
import {Asset, Shape} from './asset.js';
import {count, desk, kMostPatches, notNegative, sphereMeasureOf, writePose, writeSettings} from './desk.js';
import {IstError} from './error.js';
import {check, f64, functions, Room, u32} from './memory.js';
import {checkOptions} from './options.js';

/** The address in the form of exports.c: that of a shape is odd. */
export function solid(given, which, query) {
  if (given instanceof Asset) return given._at;
  if (given instanceof Shape) return given._at + 1;
  throw new IstError(`ist: ${query}: solid ${which} must be an Asset or a Shape`);
}

function assetsOf(a, b, query, what) {
  for (const [given, which] of [[a, 'A'], [b, 'B']])
    if (!(given instanceof Asset))
      throw new IstError(`ist: ${query}: solid ${which} must be an Asset: a shape has no ${what}`);
  return [a._at, b._at];
}

/**
 * Writes a query to the desk and runs it: `question` names an export. Returns the status, which is
 * no error.
 */
export function ask(question, who, a, b, poseB, options, more) {
  const wasm = functions(who);
  checkOptions(who, options);
  const first = solid(a, 'A', who), second = solid(b, 'B', who);
  if (a instanceof Shape && b instanceof Shape)
    throw new IstError(`ist: ${who}: both solids are shapes; one must be an Asset`);
  writePose(0, options?.poseA, 'poseA');
  writePose(1, poseB, 'poseB');
  writeSettings(options);
  const status = wasm[question](first, second, more);
  check(status, who);
  return status;
}

export function penetration(a, b, poseB, options) {
  const status = ask('penetration', 'penetration()', a, b, poseB, options, 0);
  return readPenetration(desk().penetration, status, options?.into ?? newPenetration());
}

export const newSeparation = () => ({status: 'ok', distance: 0, ...newGap(), spherePairs: 0});

export function separation(a, b, poseB, options) {
  functions('separation()');
  f64()[desk().numbers / 8] = notNegative(options?.maxDistance ?? 0, 'maxDistance');
  const status = ask('separation', 'separation()', a, b, poseB, options, options?.innerSpheres ? 1 : 0);
  return readSeparation(status, options?.into ?? newSeparation());
}

/** Reads the separation on the desk. */
export function readSeparation(status, out) {
  const integers = u32(), at = desk().separation / 8 + 1;
  out.status = statusOf(status);
  out.distance = f64()[at];
  out.nodeVisits = integers[2 * at + 24];
  out.spherePairs = integers[2 * at + 25];
  return readGap(at, out);
}

export function maxPatchesOf(options) {
  const most = options?.maxPatches ?? 8;
  if (!(Number.isInteger(most) && most >= 1 && most <= kMostPatches))
    throw new IstError(
        `ist: maxPatches is ${most}; it must be a whole number from 1 to ${kMostPatches}`);
  return most;
}

export function contactPatches(a, b, poseB, options) {
  const most = maxPatchesOf(options);
  const status = ask('contact_patches', 'contactPatches()', a, b, poseB, options, most);
  const out = options?.into ?? newPatches();
  readPenetration(desk().penetration, status, out.whole);
  readPatches(desk().patches, u32()[desk().counts / 4], out);
  return out;
}

const kOverlapping = ['no', 'yes', 'unknown'];
export function overlap(a, b, poseB, options) {
  return kOverlapping[ask('overlap', 'overlap()', a, b, poseB, options, 0)];
}

const room = new Room();
const kSegmentBytes = 56;

export function overlapOutline(a, b, poseB, options) {
  const wasm = functions('overlapOutline()');
  checkOptions('overlapOutline()', options);
  const [first, second] = assetsOf(a, b, 'overlapOutline()', 'mesh');
  writePose(0, options?.poseA, 'poseA');
  writePose(1, poseB, 'poseB');
  writeSettings({maxVisits: options?.maxVisits, pairId: options?.pairId});
  const most = maxPatchesOf(options), counts = desk().counts / 4;
  let place, status, capacity, total = Math.max(1024, options?.into?.patch.length ?? 0);
  do {
    capacity = total;
    place = room.of(kSegmentBytes * capacity);
    status = wasm.overlap_outline(first, second, most, place, capacity);
    check(status, 'overlapOutline()');
    total = u32()[counts + 1];
  } while (total > capacity);
  const out = options?.into ??
      {contact: newPatches(), count: 0, segments: new Float64Array(0), patch: new Uint32Array(0)};
  readPenetration(desk().penetration, status, out.contact.whole);
  readPatches(desk().patches, u32()[counts], out.contact);
  out.count = total;
  if (out.segments.length < 6 * total) out.segments = new Float64Array(6 * total);
  if (out.patch.length < total) out.patch = new Uint32Array(total);
  const numbers = f64(), integers = u32();
  for (let i = 0; i < total; ++i) {
    const from = (place + kSegmentBytes * i) / 8;
    for (let k = 0; k < 6; ++k) out.segments[6 * i + k] = numbers[from + k];
    out.patch[i] = integers[2 * from + 12];
  }
  return out;
}

export function lenses(a, b, poseB, options) {
  const wasm = functions('lenses()');
  checkOptions('lenses()', options);
  const [first, second] = assetsOf(a, b, 'lenses()', 'spheres');
  writePose(0, options?.poseA, 'poseA');
  writePose(1, poseB, 'poseB');
  sphereMeasureOf(options?.measure);
  writeSettings({measure: options?.measure});
  const most = count(options?.maxLenses, 4096, 'maxLenses');
  const place = room.of(72 * most);
  const status = wasm.lenses(
      first, second, count(options?.detailA, 0, 'detailA'), count(options?.detailB, 0, 'detailB'),
      place, most);
  check(status, 'lenses()');
  const out = options?.into ?? {total: 0, count: 0, data: new Float64Array(0)};
  const integers = u32(), numbers = f64(), counts = desk().counts / 4;
  out.total = integers[counts];
  out.count = integers[counts + 1];
  if (out.data.length < 10 * out.count)
    out.data = new Float64Array(10 * (options?.into ? most : out.count));
  for (let i = 0; i < out.count; ++i) {
    const from = place / 8 + 9 * i, to = 10 * i;
    for (let k = 0; k < 8; ++k) out.data[to + k] = numbers[from + k];
    out.data[to + 8] = integers[2 * from + 16];
    out.data[to + 9] = integers[2 * from + 17];
  }
  return out;
}
