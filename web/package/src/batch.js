// Many pairs in one call.

import {kPatchBytes, kPenetrationBytes, newPatches, newPenetration, readPatches, readPenetration} from './answers.js';
import {writePoseAt, writeSettings} from './desk.js';
import {IstError} from './error.js';
import {functions, Room, u32} from './memory.js';
import {checkOptions} from './options.js';
import {maxPatchesOf, solid} from './query.js';

const kPairBytes = 136;  // asked_pair_t
const room = new Room();

/** Writes the pairs of a batch to `place`. */
function writePairs(place, pairs, who) {
  let i = 0;
  try {
    for (; i < pairs.length; ++i) {
      const pair = pairs[i], at = place + i * kPairBytes, words = u32();
      words[at / 4] = solid(pair.a, 'A', who);
      words[at / 4 + 1] = solid(pair.b, 'B', who);
      writePoseAt(at + 8, pair.poseA, 'poseA');
      if (!pair.poseB) throw new IstError('ist: poseB is missing: {rotation, translation, scale}');
      writePoseAt(at + 72, pair.poseB, 'poseB');
    }
  } catch (error) {
    if (error instanceof IstError || error instanceof TypeError) error.message = error.message.replace('ist:', `ist: pair ${i}:`);
    throw error;
  }
}

/** The status is an answer's second word. */
const statusAt = (place) => u32()[place / 4 + 1] | 0;

export function penetrationBatch(pairs, options) {
  const wasm = functions('penetrationBatch()'), count = pairs.length;
  checkOptions('penetrationBatch()', options);
  const place = room.of(count * (kPairBytes + kPenetrationBytes));
  const answers = place + count * kPairBytes;
  writePairs(place, pairs, 'penetrationBatch()');
  writeSettings(options);
  wasm.penetration_batch(place, count, answers);
  const out = options?.into ?? [];
  if (out.length !== count) out.length = count;
  for (let i = 0; i < count; ++i) {
    const at = answers + i * kPenetrationBytes;
    out[i] = readPenetration(at, statusAt(at), out[i] ?? newPenetration());
  }
  return out;
}

export function contactPatchesBatch(pairs, options) {
  const wasm = functions('contactPatchesBatch()'), count = pairs.length;
  checkOptions('contactPatchesBatch()', options);
  const most = maxPatchesOf(options);
  const wholes = count * kPairBytes, patches = wholes + count * kPenetrationBytes;
  const counts = patches + count * most * kPatchBytes;
  const place = room.of(counts + 4 * count);
  writePairs(place, pairs, 'contactPatchesBatch()');
  writeSettings(options);
  wasm.contact_patches_batch(place, count, place + wholes, place + patches, most, place + counts);
  const out = options?.into ?? [];
  if (out.length !== count) out.length = count;
  for (let i = 0; i < count; ++i) {
    const at = place + wholes + i * kPenetrationBytes;
    const found = out[i] ??= newPatches();
    readPenetration(at, statusAt(at), found.whole);
    readPatches(place + patches + i * most * kPatchBytes, u32()[(place + counts) / 4 + i], found);
  }
  return out;
}
