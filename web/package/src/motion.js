// Solids that move: from pose to pose, and when they meet.

import {newVector, statusOf} from './answers.js';
import {copy3, count, desk, kImpact, kImpactSettings, kMotion, kMotionBytes, kNumbers, writeNumbers, writePose} from './desk.js';
import {IstError} from './error.js';
import {check, f64, functions, u32} from './memory.js';
import {checkOptions} from './options.js';
import {ask} from './query.js';

const kOrigin = [0, 0, 0];

/** Writes motion A (0) or B (1); none is at rest. */
function writeMotion(which, motion, what) {
  const numbers = f64(), at = (desk() + kMotion + which * kMotionBytes) / 8;
  writeNumbers(numbers, at, motion?.velocity, kOrigin, 3, what, '.velocity');
  writeNumbers(numbers, at + 3, motion?.angularVelocity, kOrigin, 3, what, '.angularVelocity');
  writeNumbers(numbers, at + 6, motion?.about, kOrigin, 3, what, '.about');
}

function positive(value, what) {
  if (!(value > 0 && value < Infinity))
    throw new IstError(`ist: ${what} is ${value}; it must be > 0`);
  return value;
}

export function motionBetween(from, to, duration, about) {
  const wasm = functions('motionBetween()');
  writePose(1, from, 'from');
  writePose(0, to, 'to');
  const numbers = f64(), at = (desk() + kNumbers) / 8;
  numbers[at] = positive(duration, 'duration');
  writeNumbers(numbers, at + 1, about, kOrigin, 3, 'about');
  check(wasm.motion_between(), 'motionBetween()');
  const out = {velocity: newVector(), angularVelocity: newVector(), about: newVector()};
  const motion = (desk() + kMotion + kMotionBytes) / 8;
  copy3(numbers, motion, out.velocity);
  copy3(numbers, motion + 3, out.angularVelocity);
  copy3(numbers, motion + 6, out.about);
  return out;
}

export function moved(start, motion, time, into) {
  const wasm = functions('moved()');
  writePose(1, start, 'start');
  writeMotion(1, motion, 'motion');
  const numbers = f64(), at = desk() / 8 + 8;
  numbers[(desk() + kNumbers) / 8] = time;
  check(wasm.moved(), 'moved()');
  const out = into ?? {rotation: new Float64Array(4), translation: newVector(), scale: 1};
  for (let i = 0; i < 4; ++i) out.rotation[i] = numbers[at + i];
  copy3(numbers, at + 4, out.translation);
  out.scale = start.scale ?? 1;
  return out;
}

const kKinds = ['none', 'impact', 'unresolved', 'overlapping'];
const newImpact = () => ({
  status: 'ok',
  kind: 'none',
  time: 0,
  distanceMin: 0,
  distanceMax: 0,
  pointA: newVector(),
  pointB: newVector(),
  normal: newVector(),
  nodeVisits: 0,
  surfacePairs: 0,
});

export function timeOfImpact(a, b, poseB, options) {
  functions('timeOfImpact()');
  checkOptions('timeOfImpact()', options);
  writeMotion(0, options?.motionA, 'motionA');
  writeMotion(1, options?.motionB, 'motionB');
  const settings = desk() + kImpactSettings;
  u32()[settings / 4 + 1] = count(options?.maxVisits, 0, 'maxVisits');
  const given = f64();
  given[settings / 8 + 1] = positive(options?.duration ?? 1, 'duration');
  given[settings / 8 + 2] = options?.tolerance ?? 0;
  const status = ask('time_of_impact', 'timeOfImpact()', a, b, poseB, options, 0);
  const out = options?.into ?? newImpact();
  const numbers = f64(), integers = u32();
  const words = (desk() + kImpact) / 4, at = (desk() + kImpact) / 8 + 3;
  out.status = statusOf(status);
  out.kind = kKinds[integers[words + 2]];
  out.nodeVisits = integers[words + 3];
  out.surfacePairs = integers[words + 4];
  out.time = numbers[at];
  out.distanceMin = numbers[at + 1];
  out.distanceMax = numbers[at + 2];
  copy3(numbers, at + 3, out.pointA);
  copy3(numbers, at + 6, out.pointB);
  copy3(numbers, at + 9, out.normal);
  return out;
}
