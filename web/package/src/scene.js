// Many bodies, and which of them meet.

import {newPenetration, readPenetration} from './answers.js';
import {checkMembers, count, desk, kPose, notNegative, positive, writeNumbers, writePose, writeSettings} from './desk.js';
import {IstError} from './error.js';
import {check, f64, functions, Room, u32} from './memory.js';
import {checkOptions} from './options.js';
import {newSeparation, readSeparation, solid} from './query.js';
import {askRays, checkRows, kHit, kSurfacePoint, placePoints, read} from './surfaces.js';

const kAnswers = ['penetration', 'nothing', 'boxes', 'overlap'];  // as ist_scene_answer_t
const kOverlapping = ['no', 'yes', 'unknown'];
const kPairBytes = 24, kPoseBytes = 56, kTooMany = 1;  // IST_BUDGET_EXHAUSTED
const kMost = 2 ** 30, kMostGroup = 7;  // of SceneSettings, and kSceneGroups − 1
const room = new Room();
const forgotten = new FinalizationRegistry((place) => functions('a Scene').scene_release(place));

/** `length` words from `place`, copied into `out` if that is long enough. */
function copied(out, place, length) {
  if (!(out?.length >= length)) out = new Uint32Array(length);
  const words = u32();
  for (let i = 0; i < length; ++i) out[i] = words[place / 4 + i];
  return out;
}

export class Scene {
  constructor(options) {
    const wasm = functions('Scene()');
    checkOptions('Scene()', options);
    const most = count(options?.maxBodies, 1024, 'maxBodies', 1, kMost);
    const pairs = count(options?.maxPairs, 8192, 'maxPairs', 1, kMost);
    this._place = wasm.scene_make(most, pairs) >>> 0;
    if (this._place === 0) throw new IstError('ist: out of memory for a Scene');
    this._maxPairs = pairs;
    this._solids = new Map();  // by number
    forgotten.register(this, this._place, this);
  }

  free() {
    if (this._place === null) return;
    forgotten.unregister(this);
    functions('a Scene').scene_release(this._place);
    for (const body of this._solids.values()) --body._bodies;
    this._solids.clear();
    this._place = null;
  }

  get _at() {
    if (this._place === null) throw new IstError('ist: a Scene was used after free()');
    return this._place;
  }

  get size() {
    return this._solids.size;
  }

  add(given, pose, options) {
    const wasm = functions('Scene.add()'), at = solid(given, 'A', 'Scene.add()');
    checkOptions('Scene.add()', options);
    writePose(0, pose, 'pose');
    let number = count(options?.number, -1, 'number');
    if (number === -1) {
      number = 0;
      for (const taken of this._solids.keys()) number = Math.max(number, taken + 1);
    }
    const status = wasm.scene_add(
        this._at, at, number, (options?.moves ?? true) ? 0 : 1, count(options?.group, 0, 'group', 0, kMostGroup),
        count(options?.layers, 1, 'layers'), count(options?.meets, 0xffffffff, 'meets'));
    check(status, `Scene.add(), body ${number}`);
    this._solids.set(number, given);
    ++given._bodies;
    return number;
  }

  remove(number) {
    check(functions('Scene.remove()').scene_remove(this._at, number), `Scene.remove(), body ${number}`);
    --this._solids.get(number)._bodies;
    this._solids.delete(number);
  }

  setPoses(numbers, poses) {
    const wasm = functions('Scene.setPoses()'), length = numbers.length;
    if (poses.length !== length)
      throw new IstError(`ist: Scene.setPoses(): ${length} numbers and ${poses.length} poses`);
    const place = room.of((kPoseBytes + 4) * length), at = place + kPoseBytes * length;
    for (let i = 0; i < length; ++i) {
      u32()[at / 4 + i] = count(numbers[i], 0, 'number');
      checkMembers(poses[i], kPose, 'pose');
      writeNumbers(f64(), (place + kPoseBytes * i) / 8, poses[i].rotation, [1, 0, 0, 0], 4, 'pose', 'rotation');
      writeNumbers(f64(), (place + kPoseBytes * i) / 8 + 4, poses[i].translation, [0, 0, 0], 3, 'pose', 'translation');
    }
    check(wasm.scene_set_poses(this._at, at, place, length), 'Scene.setPoses()');
  }

  setRule(groupA, groupB, options) {
    const wasm = functions('Scene.setRule()');
    checkOptions('Scene.setRule()', options);
    const answer = kAnswers.indexOf(options?.answer ?? 'penetration');
    if (answer < 0)
      throw new IstError(`ist: answer is ${options.answer}; use one of ${kAnswers.join(', ')}`);
    writeSettings(options);
    const margin = notNegative(options?.margin ?? 0, 'margin');
    const status = wasm.scene_set_rule(
        this._at, count(groupA, 0, 'groupA', 0, kMostGroup), count(groupB, 0, 'groupB', 0, kMostGroup), answer, margin);
    check(status, 'Scene.setRule()');
  }

  exclude(a, b) {
    check(functions('Scene.exclude()').scene_join(this._at, a, b, 1), 'Scene.exclude()');
  }
  include(a, b) {
    check(functions('Scene.include()').scene_join(this._at, a, b, 0), 'Scene.include()');
  }

  step(options) {
    const wasm = functions('Scene.step()');
    checkOptions('Scene.step()', options);
    const place = room.of(36), status = wasm.scene_step(this._at, place);
    if (status === kTooMany)
      throw new IstError(`ist: more than ${this._maxPairs} pairs of bodies have boxes that meet: make the Scene with a larger maxPairs`);
    check(status, 'Scene.step()');
    const [pairs, ended, refused, all, over, left] = u32().subarray(place / 4 + 2, place / 4 + 8);
    const out = options?.into ?? {pairs: [], ended: new Uint32Array(0), refused: new Uint32Array(0)};
    out.count = all;
    for (let i = 0; i < all; ++i) {
      const pair = out.pairs[i] ??= {penetration: newPenetration(), separation: newSeparation()};
      const of = (pairs + kPairBytes * i) / 4, words = u32();
      pair.a = words[of];
      pair.b = words[of + 1];
      pair.begins = words[of + 2] === 0;
      pair.overlapping = kOverlapping[words[of + 3]];
      const found = wasm.scene_answers(this._at, pairs + kPairBytes * i);
      readPenetration(desk().penetration, found, pair.penetration);
      readSeparation(u32()[desk().separation / 4 + 1] | 0, pair.separation);
    }
    out.endedCount = over;
    out.ended = copied(out.ended, ended, 2 * over);
    out.refusedCount = left;
    out.refused = copied(out.refused, refused, left);
    return out;
  }

  raycast(origins, directions, options) {
    const {place, count: rays, hits, more} = askRays('Scene.raycast()', origins, directions, options, 4);
    const status = functions('Scene.raycast()').scene_raycast(this._at, place, rays, more, hits);
    checkRows(status, rays, 'Scene.raycast()');
    const out = read(hits, rays, kHit, options?.into ?? {});
    out.number = copied(out.number, more, rays);
    return out;
  }

  nearest(points, options) {
    const {place, count: rows, answers} = placePoints('Scene.nearest()', points, options, 76);
    const far = positive(options?.maxDistance ?? Infinity, 'maxDistance', Infinity), more = answers + 72 * rows;
    const status = functions('Scene.nearest()').scene_nearest(this._at, place, rows, far, more, answers);
    checkRows(status, rows, 'Scene.nearest()');
    const out = read(answers, rows, kSurfacePoint, options?.into ?? {});
    out.number = copied(out.number, more, rows);
    return out;
  }
}
