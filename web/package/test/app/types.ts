// Compiles only if the types say what docs/web.md does.
import {Asset, Field, IstError, contactPatches, init, lenses, overlap, penetration, separation, version} from 'ist-query';
import * as compat from 'ist-query/compat';
import type {ContactPatches, Penetration, PenetrationOptions, Pose, Surface} from 'ist-query';

await init({wasm: fetch('ist.wasm')});
await compat.init();
const a: Asset = Asset.from(await (await fetch('a.ist')).arrayBuffer(), 'a.ist');
const pose: Pose = {rotation: new Float64Array([1, 0, 0, 0]), translation: [0, 0, 1]};
const options: PenetrationOptions = {measure: 'matched'};
const answer: Penetration = (options.into = penetration(a, a, pose, options));
const found: ContactPatches = contactPatches(Field.halfSpace([0, 0, 1]), a, pose, {maxPatches: 4});
const surface: Surface | null = a.surface();
const sum: number = answer.volume + separation(a, a, pose).distance + found.patches[0].area +
    lenses(a, a, pose).data[0] + a.info().details[0] + (surface?.triangles.length ?? 0) + a.spheres({detail: 1})[0];
const words: string = version() + overlap(a, a, {}) + new IstError('x').status.toFixed(sum);
// @ts-expect-error
penetration(a, Field.ball(1), pose);
// @ts-expect-error
penetration(a, a, pose, {measure: 'outer'});
export {words};
