// Assets and shapes: objects in WebAssembly's memory, which is released.

import {kMissingData} from './answers.js';
import {count, desk, notNegative, positive, sphereMeasureOf, writeNumbers} from './desk.js';
import {IstError} from './error.js';
import {check, f64, functions, give, take, u32, u8, withRoom} from './memory.js';
import {checkOptions} from './options.js';

/** Releases memory without references. */
const forgotten = new FinalizationRegistry((places) => places.forEach(give));

/** An owner of memory: a list of addresses. */
class Owner {
  constructor(places, key) {
    if (key !== kInside)
      throw new IstError(`ist: ${this.constructor.name} has no public constructor; use its static functions`);
    this._places = places;
    this._bodies = 0;  // of scenes
    forgotten.register(this, places, this);
  }

  free() {
    if (this._places === null) return;
    if (this._bodies > 0)
      throw new IstError(`ist: free(): ${this._bodies} bodies of a Scene are made of it; remove them first`);
    forgotten.unregister(this);
    this._places.forEach(give);
    this._places = null;
  }
}
const kInside = Symbol('inside');

function vector(at) {
  return f64().slice(at, at + 3);
}

/** The bytes of an ArrayBuffer or a view. */
function bytesOf(given) {
  if (ArrayBuffer.isView(given))
    return new Uint8Array(given.buffer, given.byteOffset, given.byteLength);
  if (given instanceof ArrayBuffer ||
      (typeof SharedArrayBuffer !== 'undefined' && given instanceof SharedArrayBuffer))
    return new Uint8Array(given);
  throw new IstError(
      'ist: Asset.from() takes an ArrayBuffer or a view of one, e.g. ' +
      'await (await fetch(address)).arrayBuffer()');
}

const kMeshStates = ['none', 'own', 'resolved', 'polygonised', 'unresolved'];

export class Asset extends Owner {
  static from(given, name = 'asset') {
    const wasm = functions('Asset.from()');
    const bytes = bytesOf(given);
    const place = take(64 + bytes.length);
    try {
      u8().set(bytes, place + 64);
      check(wasm.tree(place, bytes.length), name);
    } catch (error) {
      give(place);
      throw error;
    }
    return new Asset(place, name, bytes.length, kInside);
  }

  constructor(place, name, bytes, key) {
    super([place], key);
    this._name = name;
    this._bytes = bytes;
  }

  /** Its handle in WebAssembly. */
  get _at() {
    if (this._places === null) throw new IstError(`ist: ${this._name} was used after free()`);
    return this._places[0];
  }

  _told() {
    check(functions('an asset').info(this._at), this._name);
    return f64();
  }

  info() {
    const numbers = this._told();
    const integers = u32(), at = desk().info / 4, values = at / 2 + 2;
    const details = [];
    const spheres = integers[at + 2] + 2 ** 32 * integers[at + 3];
    // A mesh-only asset has no levels of spheres.
    for (let i = 0; spheres > 0 && i < integers[at + 1]; ++i)
      details.push(this._count({detail: i}, 0));
    return {
      name: this._name,
      bytes: this._bytes,
      spheres,
      details,
      volume: numbers[values],
      coverage: numbers[values + 1],
      protrusion: numbers[values + 2],
      meshState: kMeshStates[integers[at + 11]],
      meshTriangles: integers[at + 10],
      meshError: numbers[values + 4],
      selfOverlapVolume: numbers[values + 5],
    };
  }

  bounds() {
    const numbers = this._told(), at = desk().bounds / 8 + 1;
    return {
      lower: vector(at),
      upper: vector(at + 3),
      centre: vector(at + 6),
      radius: numbers[at + 9]
    };
  }

  massProperties() {
    const numbers = this._told(), at = desk().mass / 8 + 1;
    return {
      volume: numbers[at],
      centreOfMass: vector(at + 1),
      inertia: numbers.slice(at + 4, at + 13)
    };
  }

  /** Writes the first `capacity` balls to `room`; returns the number of all. */
  _balls(set, level, room, capacity) {
    checkOptions('Asset.spheres()', set);
    const detail = count(set?.detail, 0, 'detail');
    const measure = sphereMeasureOf(set?.measure);
    const status = functions('an asset').balls(this._at, measure, detail, level, room, capacity);
    if (status === kMissingData)
      throw new IstError(`ist: ${this._name}: is a mesh alone, without spheres`, status);
    if (status < 0)
      throw new IstError(
          `ist: ${this._name}: has no level ${level} of detail ${detail} in its ` +
              `${set?.measure ?? 'matched'} spheres`,
          status);
    return u32()[desk().counts / 4];
  }

  _count(set, level) {
    return this._balls(set, level, 0, 0);
  }

  spheres(set) {
    return this.level(0, set);
  }

  levelCount(set) {
    let level = 0;
    while (this._count(set, level) > 16) ++level;
    return level + 1;
  }

  level(level, set) {
    const most = this._count(set, count(level, 0, 'level'));
    return withRoom(32 * most, (room) => {
      this._balls(set, level, room, most);
      return f64().slice(room / 8, room / 8 + 4 * most);
    });
  }

  mesh() {
    const wasm = functions('an asset');
    check(wasm.mesh(this._at, 0, 0, 0, 0), this._name);
    const counts = desk().counts / 4;
    const vertices = u32()[counts], triangles = u32()[counts + 1];
    if (triangles === 0) return null;
    return withRoom(24 * vertices + 12 * triangles, (room) => {
      const corners = room + 24 * vertices;
      check(wasm.mesh(this._at, room, vertices, corners, triangles), this._name);
      return {
        positions: f64().slice(room / 8, room / 8 + 3 * vertices),
        triangles: u32().slice(corners / 4, corners / 4 + 3 * triangles),
      };
    });
  }
}

// ist_shape_kind_t
const kHalfSpace = 1, kBox = 2, kBall = 3, kCapsule = 4, kCylinder = 5, kHeights = 6,
      kDistanceGrid = 7;

/** A shape with up to eight numbers, and `data`, whose memory it owns. */
function made(kind, numbers, data = 0, columns = 0, rows = 0, layers = 0) {
  const owned = data === 0 ? [] : [data];
  try {
    const wasm = functions('a shape');
    const absent = numbers.concat(Array(8 - numbers.length).fill(0));
    writeNumbers(f64(), desk().a / 8, absent, absent, 8, 'a shape');
    const place = wasm.field(kind, data, columns, rows, layers) >>> 0;
    if (place === 0) throw new IstError('ist: out of memory for a shape');
    return new Shape([place, ...owned], kInside);
  } catch (error) {
    owned.forEach(give);
    throw error;
  }
}

function three(given, what) {
  if (given?.length !== 3) throw new IstError(`ist: ${what} must have three numbers`);
  return [given[0], given[1], given[2]];
}

/** A copy of one float per point of a grid. */
function copied(given, points, what) {
  for (const along of points)
    if (!(Number.isInteger(along) && along >= 2))
      throw new IstError(`ist: ${what} needs at least two points along each axis, not ${along}`);
  const wanted = points.reduce((a, b) => a * b);
  if (!(given instanceof Float32Array) || given.length !== wanted)
    throw new IstError(
        `ist: ${what} needs a Float32Array of ${points.join(' · ')} = ${wanted} numbers` +
        (given instanceof Float32Array ? `, not ${given.length}` : ''));
  functions(what);
  const place = take(4 * wanted);
  u8().set(new Uint8Array(given.buffer, given.byteOffset, given.byteLength), place);
  return place;
}

export class Shape extends Owner {
  static halfSpace(normal, offset = 0) {
    const along = three(normal, 'normal');
    positive(Math.hypot(...along), 'the length of normal');
    return made(kHalfSpace, [...along, offset]);
  }
  static box(halfExtents) {
    const sizes = three(halfExtents, 'halfExtents');
    sizes.forEach((size, k) => positive(size, `halfExtents[${k}]`));
    return made(kBox, sizes);
  }
  static ball(radius) {
    return made(kBall, [positive(radius, 'radius')]);
  }
  static capsule(radius, halfHeight) {
    return made(kCapsule, [positive(radius, 'radius'), notNegative(halfHeight, 'halfHeight')]);
  }
  static cylinder(radius, halfHeight) {
    return made(kCylinder, [positive(radius, 'radius'), positive(halfHeight, 'halfHeight')]);
  }

  static heights(heights, columns, rows, spacing) {
    if (spacing?.length !== 2)
      throw new IstError('ist: spacing must have two numbers, along x and y');
    positive(spacing[0], 'spacing[0]');
    positive(spacing[1], 'spacing[1]');
    const data = copied(heights, [columns, rows], 'Shape.heights()');
    let lowest = Infinity, highest = -Infinity;
    for (const h of heights) {
      lowest = Math.min(lowest, h);
      highest = Math.max(highest, h);
    }
    if (!(highest - lowest < Infinity)) throw new IstError('ist: a height is no finite number');
    // Both 0 means unknown, which is also valid for level ground at 0.
    return made(kHeights, [spacing[0], spacing[1], lowest, highest], data, columns, rows);
  }

  static distanceGrid(distances, points, spacing, options) {
    checkOptions('Shape.distanceGrid()', options);
    positive(spacing, 'spacing');
    notNegative(options?.error ?? 0, 'error');
    const along = three(points, 'points');
    const origin = three(options?.origin ?? [0, 0, 0], 'origin');
    const data = copied(distances, along, 'Shape.distanceGrid()');
    return made(kDistanceGrid, [...origin, spacing, options?.error ?? 0], data, ...along);
  }

  /** Its address in WebAssembly. */
  get _at() {
    if (this._places === null) throw new IstError('ist: a shape was used after free()');
    return this._places[0];
  }
}
