// ist in JavaScript: penetration volume, force, torque and distance of solids, from .ist assets.
//
// Lengths are [u], the unit of the mesh that was baked. Everything is in double precision.
// Every function except init() is synchronous, and throws an IstError with one English sentence:
// what is wrong, and the remedy. An option that is misspelt throws a TypeError that names it, and so does a member of a pose or a motion.
// The module keeps its memory in WebAssembly: assets and shapes are released by free(), or some time
// after the last reference is gone.
// Each worker of a page has its own module and awaits its init().

/** Source of the WebAssembly. The default is beside the module, or in it (compat). */
export interface InitOptions {
  /** Bytes, a compiled module, or an address (or Response) to fetch them from. */
  wasm?:
    | BufferSource
    | WebAssembly.Module
    | Response
    | URL
    | string
    | PromiseLike<BufferSource | WebAssembly.Module | Response>;
}

/**
 * Loads the WebAssembly: `await init()` once, before anything else. A second call waits for the
 * same module; after a failure it tries again.
 */
export function init(options?: InitOptions): Promise<void>;

/** Version of the library, `0.1.0`. */
export function version(): string;

/** An error of this package. */
export class IstError extends Error {
  /** ist_status_t of <ist/c.h>, < 0; 0 if the module itself refuses. */
  readonly status: number;
}

// --- Places -----------------------------------------------------------------------------------------

/** Three numbers: an array, a typed array. */
export type Vector = ArrayLike<number>;

/** x_world = R(rotation) (scale · x) + translation. Omitted members are the identity's. */
export interface Pose {
  /** Quaternion w, x, y, z, not 0; it is normalised. (three.js has x, y, z, w.) */
  rotation?: ArrayLike<number>;
  /** [u] */
  translation?: Vector;
  /** > 0 */
  scale?: number;
}

// --- Assets -----------------------------------------------------------------------------------------

/** `matched`: spheres whose volumes sum to the solid's. `inner`: spheres inside it. */
export type SphereMeasure = 'matched' | 'inner';

/**
 * The representation of the solid: a set of spheres, or its mesh. `exact`: the true volume and its
 * gradients, for two assets that both store their mesh (AssetInfo.meshTriangles > 0). `matched` goes
 * over to it where the spheres are too coarse for the contact of two solids of unlike sizes that
 * both store theirs (ContactOptions.spheresOnly).
 */
export type Measure = SphereMeasure | 'exact';

export interface AssetInfo {
  /** As given to Asset.from(). */
  name: string;
  /** Bytes of the asset. */
  bytes: number;
  /** Count of spheres, of each of the two sets. 0: a mesh alone, without spheres to query. */
  spheres: number;
  /** Count of spheres of the matched set at each level of detail, finest first. */
  details: number[];
  /** [u³] of the solid. */
  volume: number;
  /** [0, 1] share of the solid in inner spheres. */
  coverage: number;
  /** [u] bound on how far matched spheres stick out of the solid. */
  protrusion: number;
  /**
   * State of the mesh for exact queries. `polygonised`: made from a signed distance. `unresolved`:
   * none, since it counts volume twice.
   */
  meshState: 'none' | 'own' | 'resolved' | 'polygonised' | 'unresolved';
  /** Count of triangles of that mesh, 0: there is none. */
  meshTriangles: number;
  /** [u] its surface and the solid's lie within this of each other. */
  meshError: number;
  /** [u³] volume that the input mesh counts more than once. */
  selfOverlapVolume: number;
}

/** A box and a ball that contain the solid. */
export interface Bounds {
  /** [u] corners of the box along the axes. */
  lower: Float64Array;
  upper: Float64Array;
  /** [u] a ball. */
  centre: Float64Array;
  radius: number;
}

/** For density 1. Multiply by a density for mass and inertia. */
export interface MassProperties {
  /** [u³] */
  volume: number;
  /** [u] */
  centreOfMass: Float64Array;
  /** [u⁵] about the centre of mass: 3 × 3, symmetric. */
  inertia: Float64Array;
}

/** Selects a set of spheres. */
export interface SphereSet {
  /** Default `matched`. */
  measure?: SphereMeasure;
  /** Level of detail of the matched set, 0 the finest, < AssetInfo.details.length. Default 0. */
  detail?: number;
}

/** A closed surface, for drawing and measuring. */
export interface ClosedSurface {
  /** [u] x, y, z of each vertex. */
  positions: Float64Array;
  /** Three vertices per triangle, counter-clockwise from outside. */
  triangles: Uint32Array;
}

/** An .ist asset: a solid as spheres, trees over them, and usually its mesh. */
export class Asset {
  /**
   * Copies and checks an asset's bytes.
   * `name`: for messages, for example the file's name.
   * Throws if the bytes are not an asset, or one that is old or damaged, and says which.
   */
  static from(bytes: ArrayBufferLike | ArrayBufferView, name?: string): Asset;

  info(): AssetInfo;

  /** In the asset's own frame. */
  bounds(): Bounds;
  massProperties(): MassProperties;

  /** x, y, z, radius [u] of every sphere, in the order of the packing: largest ones first. */
  spheres(set?: SphereSet): Float64Array;

  /** Levels of balls in the tree over a set: level 0 is the spheres, the last has up to sixteen. */
  levelCount(set?: SphereSet): number;
  /**
   * x, y, z, radius [u] of every ball of a level. Level 0 is the spheres; each ball of level 1 contains
   * sixteen spheres, and ball i of a higher level those of balls 16 i … 16 i + 15 of the level below.
   */
  level(level: number, set?: SphereSet): Float64Array;

  /** The stored mesh; null if there is none. */
  mesh(): ClosedSurface | null;

  /** Releases the memory. May be called twice. Throws while bodies of a Scene are made of it. */
  free(): void;
}

// --- Shapes: solids without spheres -----------------------------------------------------------------

/** A shape, as one of the two solids of a query. Make it once and use it often. */
export class Shape {
  /** normal · x ≤ offset. `normal`: outward, not 0; its length divides `offset` too. */
  static halfSpace(normal: Vector, offset?: number): Shape;
  /** Around the origin. */
  static box(halfExtents: Vector): Shape;
  static ball(radius: number): Shape;
  /** About the z axis; `halfHeight` ≥ 0 is the segment's. */
  static capsule(radius: number, halfHeight: number): Shape;
  /** About the z axis. */
  static cylinder(radius: number, halfHeight: number): Shape;
  /**
   * Terrain under a grid of heights along z, copied: `columns` (x) run fastest, heights[0] is at
   * the origin. Beyond its border it continues level.
   */
  static heights(
    heights: Float32Array,
    columns: number,
    rows: number,
    spacing: ArrayLike<number>,
  ): Shape;
  /**
   * Distances, negative inside, at the points of a grid, copied: x runs fastest. Points outside
   * the grid are outside the solid.
   */
  static distanceGrid(
    distances: Float32Array,
    points: ArrayLike<number>,
    spacing: number,
    options?: { origin?: Vector; error?: number },
  ): Shape;

  /** Releases the memory. May be called twice. Throws while bodies of a Scene are made of it. */
  free(): void;
}

// --- Queries ----------------------------------------------------------------------------------------

// Queries of a solid A and an asset B at a pose. Answers are in the world frame; `poseA` places A. A
// query that writes `into` an earlier answer allocates nothing: a loop that keeps its options and its
// answer makes no garbage.

/** Limits of a query. Omitted or 0: no limit. */
export interface Limits {
  /** Count of node pairs opened. */
  maxVisits?: number;
}

export interface ContactOptions extends Limits {
  /** Pose of A. Default: the identity. */
  poseA?: Pose;
  /** Default `matched`. `exact` obeys only the limit maxVisits. */
  measure?: Measure;
  /**
   * Sums spheres even where they are too coarse for two solids of unlike sizes, and may be wrong by
   * any factor (sizeMatch()); otherwise the meshes answer there. `matched` only. Default false.
   */
  spheresOnly?: boolean;
  /**
   * Accepted relative error of the volume, such as 0.005 for 0.5 %. The query uses the cheapest level
   * of detail, or `exact`, whose predicted error is smaller, blended smoothly. `matched` only.
   */
  relativeError?: number;
  /**
   * Count of sphere pairs to spend: if the finest level of detail needs more, coarser levels answer.
   * Choose it by measured times.
   */
  pairBudget?: number;
  /**
   * Your id of this pair of solids, ≥ 1. Calls with the same id are steps of one motion: `exact`
   * keeps nearby triangles from call to call and returns the same answer faster.
   */
  pairId?: number;
}

export interface PenetrationOptions extends ContactOptions {
  /** An answer to overwrite, which is then returned. */
  into?: Penetration;
}

/**
 * `budget-exhausted`: a limit or the workspace's capacity stopped it. volumeMin and volumeMax
 * still contain the finished sum (`exact`: the true volume). `error-exceeded`: finished, but the
 * predicted error is larger than relativeError.
 */
export type Status = 'ok' | 'budget-exhausted' | 'error-exceeded';

/** The overlap of two solids. */
export interface Penetration {
  status: Status;
  /** [u³] */
  volume: number;
  /**
   * [u³] With `exact`: bounds of the true volume. By spheres: the interval of the finished sum, as
   * wide as rounding and the part that a limit left out. It does not bound the true volume.
   */
  volumeMin: number;
  volumeMax: number;
  /** [u] of the overlap; zero if there is none. */
  centroid: Float64Array;
  /** [u²] force on B of a pressure of 1: −dV/d(translation of B). A's is the opposite. */
  force: Float64Array;
  /** [u³/rad] about B's origin: −dV/d(rotation vector of B). */
  torque: Float64Array;
  /** With `exact`: they meet in points, edges or faces, and the volume is 0. Else false. */
  touching: boolean;
  /** [u²] where they touch: of the faces that lie on each other. */
  contactArea: number;
  /** Unit, from A to B: the mean normal of these faces; zero if there is none. */
  contactNormal: Float64Array;
  /** Node pairs opened. */
  nodeVisits: number;
  /** Lenses and parts of spheres that were summed; with `exact`: crossing triangles. */
  spherePairs: number;
}

/** Throws for a pose or an option out of range, and for a solid that lacks what the measure needs. */
export function penetration(
  a: Asset | Shape,
  b: Asset | Shape,
  poseB: Pose,
  options?: PenetrationOptions,
): Penetration;

export interface SeparationOptions extends Limits {
  poseA?: Pose;
  /** Uses the inner spheres even if both assets keep a mesh. */
  innerSpheres?: boolean;
  /**
   * [u] Of solids that are farther apart than this the answer says no more: distance and distanceMin
   * are maxDistance, distanceMax is Infinity, points and normal are NaN. Certified, and much faster.
   * Omitted or 0: any distance.
   */
  maxDistance?: number;
  /** As in ContactOptions, for distances of meshes: the last nearest triangles bound the next distance. */
  pairId?: number;
  into?: Separation;
}

/**
 * The gap between two solids: between their surfaces if both keep a mesh, else between their inner
 * spheres. All zero once these overlap.
 */
export interface Separation {
  status: Status;
  /** [u] between surfaces or inner spheres. */
  distance: number;
  /** [u] the solids' distance lies within, certified. */
  distanceMin: number;
  distanceMax: number;
  /** [u] on the surfaces of A and B if both keep a mesh, else on their inner spheres. */
  pointA: Float64Array;
  pointB: Float64Array;
  /** Unit, from A to B. */
  normal: Float64Array;
  nodeVisits: number;
  spherePairs: number;
}

export function separation(
  a: Asset | Shape,
  b: Asset | Shape,
  poseB: Pose,
  options?: SeparationOptions,
): Separation;

/** One point of a contact manifold. */
export interface ContactPatch {
  /** Names the region: the same in every query of the same two solids. */
  id: number;
  /** [u] */
  centroid: Float64Array;
  /** Unit, the direction in which the patch pushes B; zero if the area is 0. */
  normal: Float64Array;
  /** [u²] |force|. */
  area: number;
  /** [u] volume / area. */
  depth: number;
  /** [u³] */
  volume: number;
  /** [u²] and [u³/rad] about B's origin: its part of Penetration's. */
  force: Float64Array;
  torque: Float64Array;
  /** [u] The point of the wrench's central axis that is nearest to the centroid. */
  point: Float64Array;
  /** [u³/rad] Residual moment about the normal of a force at `point`. */
  torsion: number;
}

export interface ContactPatchesOptions extends ContactOptions {
  /** Largest number of patches, in [1, 32]. Default 8. */
  maxPatches?: number;
  into?: ContactPatches;
}

export interface ContactPatches {
  /** The whole contact; patches sum to it. */
  whole: Penetration;
  /** Patches found. */
  count: number;
  /** The first `count` are this answer's; unused ones may follow. */
  patches: ContactPatch[];
}

export function contactPatches(
  a: Asset | Shape,
  b: Asset | Shape,
  poseB: Pose,
  options?: ContactPatchesOptions,
): ContactPatches;

export interface OverlapOutlineOptions {
  poseA?: Pose;
  /** Largest number of patches, in [1, 32]. Default 8. */
  maxPatches?: number;
  /** Most node pairs to open. Default 0: no limit. */
  maxVisits?: number;
  /** As in ContactOptions. */
  pairId?: number;
  into?: OverlapOutline;
}

export interface OverlapOutline {
  /** The patches by the `exact` measure. */
  contact: ContactPatches;
  /** Segments of the outline. 0 where maxVisits stopped it, as contact.whole.status says. */
  count: number;
  /**
   * [u] six numbers per segment: x, y, z of its start and of its end, in the world. Segments form
   * closed curves; A's surface inside B lies to the left of each, seen from outside A.
   */
  segments: Float64Array;
  /** Number in contact.patches of the patch that each segment bounds. */
  patch: Uint32Array;
}

/**
 * The curves on which the meshes of two assets cross, by patch. A patch wholly inside the other
 * solid has none. Arrays given by `into` may be longer than the answer.
 */
export function overlapOutline(
  a: Asset,
  b: Asset,
  poseB: Pose,
  options?: OverlapOutlineOptions,
): OverlapOutline;

/** Whether two solids share a point. `yes` and `no` are certain. */
export function overlap(
  a: Asset | Shape,
  b: Asset | Shape,
  poseB: Pose,
  options?: { poseA?: Pose },
): 'no' | 'yes' | 'unknown';

export interface LensesOptions {
  poseA?: Pose;
  /** Default `matched`. */
  measure?: SphereMeasure;
  /** Levels of detail of the matched sets. Default 0, the finest. */
  detailA?: number;
  detailB?: number;
  /** Largest number of lenses to write. Default 4096. */
  maxLenses?: number;
  into?: Lenses;
}

/** The lenses in which spheres of A and B overlap, for drawing. */
export interface Lenses {
  /** Number of lenses; those beyond maxLenses are only counted. */
  total: number;
  /** Lenses written. */
  count: number;
  /**
   * Ten numbers per lens: x, y, z of the middle of its thickness; its axis x, y, z (unit, from A's
   * sphere to B's); radius where it is widest [u]; thickness along the axis [u]; index of A's and of
   * B's sphere in Asset.spheres(). An ellipsoid of that size resembles it.
   */
  data: Float64Array;
}

export function lenses(a: Asset, b: Asset, poseB: Pose, options?: LensesOptions): Lenses;

// --- Rays and points against one solid --------------------------------------------------------------

// An asset must keep its mesh (AssetInfo.meshTriangles > 0). Flat arrays of three numbers per row.
// A row that cannot be answered is NaN; a single row throws.

/** Of each ray; arrays given by `into` may be longer than `count`. */
export interface RayHits {
  count: number;
  /** [u] ≥ 0; Infinity: no hit. */
  distance: Float64Array;
  /** [u] three numbers per ray, in the world; zero without a hit. */
  point: Float64Array;
  /** Unit, outward, three numbers per ray. */
  normal: Float64Array;
  /** Of the kept mesh, 2³² − 1: no hit, or a shape. */
  triangle: Uint32Array;
}

/**
 * The points where rays first meet the surface of a solid at `pose`; rays that start inside meet it
 * from within. No ray passes between two triangles. Directions may have any length but 0. One origin or one direction
 * applies to all rays. Shapes: half-spaces, boxes, balls, capsules and cylinders.
 * `maxDistance` [u]: rays end there; default Infinity.
 */
export function raycast(
  solid: Asset | Shape,
  pose: Pose,
  origins: ArrayLike<number>,
  directions: ArrayLike<number>,
  options?: { maxDistance?: number; into?: RayHits },
): RayHits;

/** Of each point; arrays given by `into` may be longer than `count`. */
export interface SurfacePoints {
  count: number;
  /** [u] to the surface, < 0 inside. */
  distance: Float64Array;
  /** [u] the solid's distance is within this of `distance`. */
  error: Float64Array;
  /** [u] on the surface, three numbers per point, in the world. */
  point: Float64Array;
  /** Of the distance: unit, outward, three numbers per point. */
  gradient: Float64Array;
  /** As in RayHits. */
  triangle: Uint32Array;
}

/** The points of a solid's surface that are nearest to points [u] of the world. */
export function closestPoint(
  solid: Asset | Shape,
  pose: Pose,
  points: ArrayLike<number>,
  options?: { into?: SurfacePoints },
): SurfacePoints;

/**
 * Whether points [u] of the world are inside a solid: 0 no, 1 yes, 2 invalid point. For a point on
 * the surface either answer is possible, always the same one.
 */
export function contains(
  solid: Asset | Shape,
  pose: Pose,
  points: ArrayLike<number>,
  options?: { into?: Uint8Array },
): Uint8Array;

/** Two bodies that meet: their volume is positive, or they touch, or come within the margin. */
export interface ScenePair {
  /** Numbers, a < b; A of the answers is `a`. */
  a: number;
  b: number;
  /** They did not meet in the step before. */
  begins: boolean;
  /** Where the rule is 'overlap'; else 'unknown'. */
  overlapping: 'no' | 'yes' | 'unknown';
  /** Zero if the rule requests none. */
  penetration: Penetration;
  /** Zero where the bodies overlap, or the rule has no margin. */
  separation: Separation;
}

export interface SceneStep {
  /** How many of `pairs` are of this step; by (a, b). */
  count: number;
  pairs: ScenePair[];
  /** Pairs that met in the step before: `endedCount` times two numbers. */
  endedCount: number;
  ended: Uint32Array;
  /** Bodies that are left out: their pose is not usable. */
  refusedCount: number;
  refused: Uint32Array;
}

/**
 * Many solids, and which of them meet. A step queries the pairs whose boxes meet and one of whose
 * bodies was added or moved; the others keep the answers of the step before. Poses and rules alone
 * decide the answers. Each Scene has a workspace of its own: 42 MB.
 */
export class Scene {
  /** Memory for as many bodies, and pairs whose boxes meet, is taken at once: 1024 and 8192. */
  constructor(options?: { maxBodies?: number; maxPairs?: number });
  /** Bodies. */
  readonly size: number;
  /**
   * Adds a body at a pose; undefined: at the origin. Returns its number: the one given, or the first
   * above all others. Two bodies that do not move are not queried, nor are two shapes. `group` (< 8)
   * selects the rule of a pair; each of a pair must be on a layer (bits) that the other meets.
   */
  add(
    solid: Asset | Shape,
    pose?: Pose,
    options?: { number?: number; moves?: boolean; group?: number; layers?: number; meets?: number },
  ): number;
  /** Its pairs end in the next step. */
  remove(number: number): void;
  /** Of bodies numbers[i]; scales are those they were added with. */
  setPoses(numbers: ArrayLike<number>, poses: ArrayLike<Pose>): void;
  /**
   * The rule for bodies of two groups, whichever is which. `margin` [u]: bodies within this distance
   * are reported too, with their separation.
   */
  setRule(
    groupA: number,
    groupB: number,
    options?: Omit<PenetrationOptions, 'poseA' | 'into' | 'pairId'> & {
      answer?: 'penetration' | 'nothing' | 'boxes' | 'overlap';
      margin?: number;
    },
  ): void;
  /** Bodies that are joined do not meet, until include() or until one of them is removed. */
  exclude(a: number, b: number): void;
  include(a: number, b: number): void;
  /** Queries all pairs that may have changed. */
  step(options?: { into?: SceneStep }): SceneStep;
  /** As raycast(), of the first body that each ray meets: `number`, 0 without a hit. */
  raycast(
    origins: ArrayLike<number>,
    directions: ArrayLike<number>,
    options?: { maxDistance?: number; into?: RayHits & { number: Uint32Array } },
  ): RayHits & { number: Uint32Array };
  /** As closestPoint(), of the nearest body: `number`; its distance is infinite where none is near. */
  nearest(
    points: ArrayLike<number>,
    options?: { maxDistance?: number; into?: SurfacePoints & { number: Uint32Array } },
  ): SurfacePoints & { number: Uint32Array };
  /** Releases the memory. May be called twice. */
  free(): void;
}


// --- Corrections and wrenches of contacts -----------------------------------------------------------

/**
 * Removes the volume that protruding spheres add where flat faces meet: the result is zero across
 * a gap of a fifth of a mean sphere radius. Round and deeper contacts are unchanged. Use it for
 * contacts, not where energy must be conserved: the force is the volume's gradient to within 15 %.
 *
 * `whole`: the answer of penetration() at these poses with {spheresOnly: true}, without a pair
 * budget. `into` may be `whole`.
 */
export function withoutProtrusion(
  whole: Penetration,
  a: Asset,
  b: Asset,
  poseB: Pose,
  options?: { poseA?: Pose; into?: Penetration },
): Penetration;

/**
 * The same for patches, in place: each by its own depth. A patch reduced to nothing is kept, with
 * zeros. `found`, `options`: the answer and the options of contactPatches().
 */
export function patchesWithoutProtrusion(
  found: ContactPatches,
  a: Asset,
  b: Asset,
  poseB: Pose,
  options?: ContactPatchesOptions,
): ContactPatches;

/** For a pressure of 1. */
export interface Wrench {
  /** [u²] out of the other body. */
  force: Float64Array;
  /** [u³/rad] about the given point. */
  torque: Float64Array;
}

export interface Wrenches {
  onA: Wrench;
  onB: Wrench;
}

/**
 * Force and torque of a contact, or a patch of it, on both bodies, about a point of each [u], usually
 * its centre of mass. Default: the world's origin. `poseB`: of the query.
 */
export function wrenches(
  contact: Penetration | ContactPatch,
  poseB: Pose,
  points?: { a?: Vector; b?: Vector },
  into?: Wrenches,
): Wrenches;

/** Whether the sizes of two assets suit each other, independent of their poses. */
export interface SizeMatch {
  /** [u] the spheres do not resolve finer features. */
  featureSizeA: number;
  featureSizeB: number;
  /** ≥ 1, coarser grain over the finer. */
  ratio: number;
  aIsCoarser: boolean;
  /** Both assets store their meshes. */
  hasMesh: boolean;
  /** Volumes and forces by spheres alone are misleading. */
  needsMesh: boolean;
  /** hasMesh, or not needsMesh. */
  fits: boolean;
}

export function sizeMatch(
  a: Asset,
  b: Asset,
  options?: { scaleA?: number; scaleB?: number },
): SizeMatch;

// --- Time of impact ---------------------------------------------------------------------------------

// [T] is a unit of time of the caller's: a second, a frame.

/** Constant velocity: one point moves straight, and the solid turns about it. */
export interface Motion {
  /** [u/T] of `about`, in the world. */
  velocity?: Vector;
  /** [rad/T] in the world. */
  angularVelocity?: Vector;
  /** [u] in the solid's own frame, before its scale: a free body's centre of mass. */
  about?: Vector;
}

/** The motion from one pose to another, the shorter way, in `duration` > 0 [T]. */
export function motionBetween(
  from: Pose,
  to: Pose,
  duration: number,
  about?: Vector,
): { velocity: Float64Array; angularVelocity: Float64Array; about: Float64Array };

/** A pose that can be overwritten. */
export interface MovedPose {
  rotation: Float64Array;
  translation: Float64Array;
  scale: number;
}

/** The pose of a solid after `time` [T] of its motion. */
export function moved(start: Pose, motion: Motion, time: number, into?: MovedPose): MovedPose;

export interface ImpactOptions extends Limits {
  /** Pose of A at the start. Default: the identity. */
  poseA?: Pose;
  /** Omitted: at rest. */
  motionA?: Motion;
  motionB?: Motion;
  /** [T] > 0: the interval is [0, duration]. Default 1. */
  duration?: number;
  /**
   * [u] Default 0: a thousandth of the smaller solid's bounding radius, or ten times the error of
   * the meshes if that is more.
   */
  tolerance?: number;
  into?: Impact;
}

export interface Impact {
  /** `budget-exhausted`: a limit; clear up to `time`. */
  status: Status;
  /**
   * `none`: clear of each other over the whole interval. `impact`: at `time` no further apart than
   * the tolerance, and approaching. `unresolved`: clear up to `time`; a later contact can be neither
   * shown nor ruled out. `overlapping`: they meet at the start.
   */
  kind: 'none' | 'impact' | 'unresolved' | 'overlapping';
  /** [T] certified: the solids do not touch before. */
  time: number;
  /** [u] Certified bounds of the solids' distance at `time`. */
  distanceMin: number;
  distanceMax: number;
  /** [u] points of A and B at `time`; others may be nearer by a part of the tolerance. */
  pointA: Float64Array;
  pointB: Float64Array;
  /** Unit, from A to B. */
  normal: Float64Array;
  nodeVisits: number;
  surfacePairs: number;
}

/**
 * A proven time up to which two moving solids stay clear: of their meshes, or where an asset stores
 * none, of balls that contain it.
 */
export function timeOfImpact(
  a: Asset | Shape,
  b: Asset | Shape,
  poseB: Pose,
  options?: ImpactOptions,
): Impact;

// --- Batches ----------------------------------------------------------------------------------------

/** One pair of a batch. */
export interface Pair {
  a: Asset | Shape;
  b: Asset | Shape;
  /** Default: the identity. */
  poseA?: Pose;
  poseB: Pose;
}

/**
 * `invalid-input`: this pair's pose is out of range; its numbers are NaN. Other pairs are not affected.
 * `missing-data`: a solid of the pair lacks what the measure needs; its numbers are NaN.
 */
export interface BatchPenetration extends Omit<Penetration, 'status'> {
  status: Status | 'invalid-input' | 'missing-data';
}
export interface BatchContactPatches extends Omit<ContactPatches, 'whole'> {
  whole: BatchPenetration;
}

/**
 * penetration() of each pair under the same options, in one call, on one thread: divide pairs among
 * workers to use more.
 */
export function penetrationBatch(
  pairs: ArrayLike<Pair>,
  options?: Omit<PenetrationOptions, 'poseA' | 'into'> & { into?: BatchPenetration[] },
): BatchPenetration[];

/** The same for contactPatches(). */
export function contactPatchesBatch(
  pairs: ArrayLike<Pair>,
  options?: Omit<ContactPatchesOptions, 'poseA' | 'into'> & { into?: BatchContactPatches[] },
): BatchContactPatches[];
