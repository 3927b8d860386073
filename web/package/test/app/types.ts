// Compiles only if the types agree with docs/web.md.
import {
  Asset, Shape, IstError, closestPoint, contains, contactPatches, contactPatchesBatch, init, lenses, motionBetween, moved, overlap, overlapOutline, sizeMatch,
  patchesWithoutProtrusion, penetration, penetrationBatch, raycast, separation, timeOfImpact, version, withoutProtrusion, wrenches,
} from 'ist-query';
import * as compat from 'ist-query/compat';
import type {
  BatchPenetration, ContactPatches, ImpactOptions, Pair, Penetration, PenetrationOptions, Pose, ClosedSurface, RayHits, Wrenches,
} from 'ist-query';

await init({wasm: fetch('ist.wasm')});
await compat.init();
const a: Asset = Asset.from(await (await fetch('a.ist')).arrayBuffer(), 'a.ist');
const pose: Pose = {rotation: new Float64Array([1, 0, 0, 0]), translation: [0, 0, 1]};
const options: PenetrationOptions = {measure: 'matched'};
const answer: Penetration = (options.into = penetration(a, a, pose, options));
const found: ContactPatches = contactPatches(Shape.halfSpace([0, 0, 1]), a, pose, {maxPatches: 4});
const curves: Float64Array = overlapOutline(a, a, pose, {maxPatches: 4}).segments;
const surface: ClosedSurface | null = a.mesh();
const sum: number = answer.volume + separation(a, a, pose).distance + found.patches[0].area +
    lenses(a, a, pose).data[0] + a.info().details[0] + (surface?.triangles.length ?? 0) + a.spheres({detail: 1})[0];
const words: string = version() + overlap(a, a, {}) + new IstError('x').status.toFixed(sum + curves[0]);
const pairs: Pair[] = [{a, b: a, poseB: pose}, {a: Shape.ball(1), b: a, poseA: {scale: 2}, poseB: moved(pose, {velocity: [1, 0, 0]}, 2)}];
const many: {into?: BatchPenetration[]} = {};
many.into = penetrationBatch(pairs, many);
const way: ImpactOptions = {motionB: motionBetween(pose, {translation: [1, 0, 0]}, 2), duration: 2};
way.into = timeOfImpact(a, a, pose, way);
const push: Wrenches = wrenches(found.patches[0], pose, {b: a.massProperties().centreOfMass});
const thin: number = withoutProtrusion(answer, a, a, pose, {into: answer}).volume + way.into.time + push.onB.torque[0] +
    patchesWithoutProtrusion(found, a, a, pose).count + contactPatchesBatch(pairs, {maxPatches: 4})[0].whole.volume +
    sizeMatch(a, a).ratio;
const hits: RayHits = raycast(a, pose, [0, 0, 9], new Float64Array([0, 0, -1]), {maxDistance: 10});
const near: number = hits.normal[2] + closestPoint(Shape.ball(1), pose, [0, 0, 2]).error[0] + contains(a, {}, [0, 0, 0])[0];
penetrationBatch([{a, b: Shape.ball(1), poseB: pose}]);
penetration(a, Shape.ball(1), pose);
// @ts-expect-error
penetration(a, a, pose, {measure: 'outer'});
// @ts-expect-error
overlapOutline(Shape.ball(1), a, pose);
export {near, thin, words};
