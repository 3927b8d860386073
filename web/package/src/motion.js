// Solids that move: from pose to pose, and when they meet.

import {kMotion, newGap, newVectors, readGap, readVectors, statusOf} from './answers.js';
import {checkMembers, copy3, count, desk, notNegative, positive, writeNumbers, writePose} from './desk.js';
import {check, f64, functions, u32} from './memory.js';
import {checkOptions} from './options.js';
import {ask} from './query.js';

const kOrigin = [0, 0, 0];

const kMotionNames = Object.keys(kMotion);

/** Writes a motion to `place`; none is at rest. */
function writeMotion(place, motion, what) {
  checkMembers(motion, kMotionNames, what);
  for (const name in kMotion)
    writeNumbers(f64(), place / 8 + kMotion[name], motion?.[name], kOrigin, 3, what, name);
}

export function motionBetween(from, to, duration, about) {
  const wasm = functions('motionBetween()');
  writePose(1, from, 'from');
  writePose(0, to, 'to');
  const numbers = f64(), at = desk().numbers / 8;
  numbers[at] = positive(duration, 'duration');
  writeNumbers(numbers, at + 1, about, kOrigin, 3, 'about');
  check(wasm.motion_between(), 'motionBetween()');
  return readVectors(kMotion, desk().motionB / 8, newVectors(kMotion));
}

export function moved(start, motion, time, into) {
  const wasm = functions('moved()');
  writePose(1, start, 'start');
  writeMotion(desk().motionB, motion, 'motion');
  const numbers = f64(), at = desk().b / 8;
  numbers[desk().numbers / 8] = time;
  check(wasm.moved(), 'moved()');
  const out = into ?? {rotation: new Float64Array(4), translation: new Float64Array(3), scale: 1};
  for (let i = 0; i < 4; ++i) out.rotation[i] = numbers[at + i];
  copy3(numbers, at + 4, out.translation);
  out.scale = start.scale ?? 1;
  return out;
}

const kKinds = ['none', 'impact', 'unresolved', 'overlapping'];
const newImpact = () => ({status: 'ok', kind: 'none', time: 0, ...newGap(), surfacePairs: 0});

export function timeOfImpact(a, b, poseB, options) {
  functions('timeOfImpact()');
  checkOptions('timeOfImpact()', options);
  writeMotion(desk().motionA, options?.motionA, 'motionA');
  writeMotion(desk().motionB, options?.motionB, 'motionB');
  const settings = desk().impactSettings;
  u32()[settings / 4 + 1] = count(options?.maxVisits, 0, 'maxVisits');
  const given = f64();
  given[settings / 8 + 1] = positive(options?.duration ?? 1, 'duration');
  given[settings / 8 + 2] = notNegative(options?.tolerance ?? 0, 'tolerance');
  const status = ask('time_of_impact', 'timeOfImpact()', a, b, poseB, options, 0);
  const out = options?.into ?? newImpact();
  const integers = u32(), words = desk().impact / 4, at = words / 2 + 3;
  out.status = statusOf(status);
  out.kind = kKinds[integers[words + 2]];
  out.nodeVisits = integers[words + 3];
  out.surfacePairs = integers[words + 4];
  out.time = f64()[at];
  return readGap(at, out);
}
