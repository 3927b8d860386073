import * as ist from 'ist-query';
import * as compat from 'ist-query/compat';
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {readFileSync} from 'node:fs';
import {test} from 'node:test';

import {baked, packageFolder, pairs} from './data.js';

const [{a: pathA, b: pathB}] = pairs();
const bytesA = readFileSync(pathA), bytesB = readFileSync(pathB);

function sentence(call) {
  try {
    call();
  } catch (error) {
    assert.equal(error.name, 'IstError', error.stack);
    return error.message;
  }
  assert.fail('nothing was thrown');
}

test('init() that nobody called or awaited is told in a sentence', async () => {
  assert.match(
      sentence(() => ist.Asset.from(bytesA)),
      /Asset\.from\(\) was called .* call and await init\(\) first/);
  assert.match(sentence(() => ist.Shape.ball(1)), /await init/);
  assert.match(sentence(() => ist.version()), /version\(\) was called/);
  const started = ist.init();
  assert.match(sentence(() => ist.Asset.from(bytesA)), /init\(\) was called, but not awaited/);
  await started;
  await ist.init();
  assert.match(ist.version(), /^\d+\.\d+\.\d+$/);
});

test('every build answers', async () => {
  await compat.init();
  const b = compat.Asset.from(bytesB), a = compat.Asset.from(bytesA);
  assert.ok(compat.penetration(a, b, {translation: [0, 0, 9]}).volume > 0);
});

test('init() takes bytes, a module and an address, and says what failed', () => {
  const script = `
    import {readFileSync} from 'node:fs';
    import * as ist from 'ist-query';
    const fail = async (wasm) => { try { await ist.init({wasm}); } catch (e) { return e.name + ': ' + e.message; } };
    const bytes = readFileSync(${JSON.stringify(packageFolder + '/dist/ist.wasm')});
    console.log(JSON.stringify([
      await fail('http://127.0.0.1:9/ist.wasm'),
      await fail(new Response('<html>')),
      await fail(new Response('', {status: 404})),
      await fail(new Uint8Array([0, 97, 115, 109, 1, 0, 0, 0, 1, 99])),
      await fail(Promise.resolve(await WebAssembly.compile(bytes))) ?? ist.version(),
    ]));`;
  const told = JSON.parse(execFileSync(
      process.execPath, ['--input-type=module', '-e', script],
      {cwd: packageFolder, encoding: 'utf8'}));
  assert.match(told[0], /^IstError: .*127\.0\.0\.1:9.* cannot be fetched.*init\(\{wasm: url\}\)/);
  assert.match(told[1], /^IstError: .* not a WebAssembly module/);
  assert.match(told[2], /^IstError: .*404.*ist-query\/compat/);
  assert.match(told[3], /^IstError: .*cannot be compiled.*SIMD/);
  assert.match(told[4], /^\d+\.\d+\.\d+$/);
});

test('broken assets are refused in the library\'s words', () => {
  const broken = Uint8Array.from(bytesA);
  broken[bytesA.length >> 1] ^= 1;
  assert.equal(
      sentence(() => ist.Asset.from(broken, 'nut.ist')),
      'ist: nut.ist: the content does not match its checksum; bake again');
  assert.match(
      sentence(() => ist.Asset.from(new TextEncoder().encode('solid something'))),
      /not an \.ist asset/);
  assert.match(sentence(() => ist.Asset.from(bytesA.subarray(0, 1000))), /is truncated/);
  assert.match(sentence(() => ist.Asset.from('nut.ist')), /takes an ArrayBuffer/);
  // A view into a larger buffer, at an odd place.
  const inside = new Uint8Array(bytesA.length + 13);
  inside.set(bytesA, 13);
  const asset = ist.Asset.from(inside.subarray(13));
  assert.equal(asset.info().bytes, bytesA.length);
  asset.free();
});

test('what an asset holds', () => {
  const asset = ist.Asset.from(bytesA, 'bolt.ist');
  const info = asset.info();
  assert.equal(info.name, 'bolt.ist');
  assert.equal(info.spheres, info.details[0]);
  assert.ok(info.details.length > 1);
  assert.ok(info.meshState === 'own' && info.meshTriangles === 4312 && info.selfOverlapVolume === 0);
  const {lower, upper} = asset.bounds();
  const mass = asset.massProperties();
  assert.equal(mass.volume, info.volume);
  assert.equal(mass.inertia[1], mass.inertia[3]);
  for (const set of [{}, {measure: 'inner'}, {detail: 1}]) {
    const spheres = asset.spheres(set);
    assert.equal(spheres.length, 4 * (set.detail ? info.details[1] : info.spheres));
    let volume = 0;
    for (let i = 0; i < spheres.length; i += 4) {
      volume += 4 / 3 * Math.PI * spheres[i + 3] ** 3;
      for (let k = 0; k < 3; ++k) assert.ok(spheres[i + k] > lower[k] && spheres[i + k] < upper[k]);
    }
    const wanted = set.measure === 'inner' ? info.coverage * info.volume : info.volume;
    assert.ok(
        Math.abs(volume / wanted - 1) < 1e-3, `${JSON.stringify(set)}: ${volume} of ${wanted}`);
    const levels = asset.levelCount(set);
    const top = asset.level(levels - 1, set).length / 4;
    assert.ok(levels >= 3 && top >= 1 && top <= 16);
    assert.match(sentence(() => asset.level(levels, set)), /has no level/);
  }
  assert.match(
      sentence(() => asset.spheres({detail: 99})), /bolt\.ist: has no level 0 of detail 99/);
  assert.match(
      sentence(() => asset.spheres({measure: 'outer'})),
      /measure is outer; use one of matched, inner/);
  asset.free();
});

test('exact is the true volume of two meshes, and refused where there is none', () => {
  const a = ist.Asset.from(bytesA), b = ist.Asset.from(bytesB), exact = {measure: 'exact'};
  const pose = {translation: [0, 0, 8.5]}, truth = 34.7409603139359;
  assert.ok(a.info().meshTriangles > 0 && a.info().meshError < 1e-9);
  const found = ist.penetration(a, b, pose, exact);
  assert.equal(found.status, 'ok');
  assert.ok(Math.abs(found.volume / truth - 1) < 1e-11, `${found.volume}`);
  assert.ok(found.volumeMin - 1e-13 <= truth && truth <= found.volumeMax + 1e-13);
  assert.ok(Math.abs(found.force[2] + 71.734) < 1e-3);
  // Steps of one motion, here of none: the third opens no node.
  const steps = [1, 2, 3].map(() => ist.penetration(a, b, pose, {...exact, pairId: 5}));
  assert.deepEqual({...steps[2], nodeVisits: found.nodeVisits}, found);
  assert.equal(steps[2].nodeVisits, 0);
  const floor = ist.Shape.halfSpace([0, 0, 1]);
  assert.match(
      sentence(() => ist.penetration(floor, b, pose, exact)), /lacks data that the query needs/);
  const [one, other] =
      ist.penetrationBatch([{a, b, poseB: pose}, {a: floor, b, poseB: pose}], exact);
  assert.deepEqual(one, found);
  assert.ok(other.status === 'missing-data' && Number.isNaN(other.volume));
  assert.match(
      sentence(() => ist.lenses(a, b, pose, exact)), /measure is exact; use one of matched, inner/);
  assert.match(
      sentence(() => ist.penetration(a, b, pose, {measure: 'outer'})),
      /measure is outer; use one of matched, inner, exact/);
  for (const each of [a, b, floor]) each.free();
});

test('the stored mesh is closed and holds the volume', () => {
  const asset = ist.Asset.from(bytesA);
  const {positions, triangles} = asset.mesh(), info = asset.info();
  assert.equal(triangles.length, 3 * info.meshTriangles);
  const edges = new Set();
  let six = 0;
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [0, 1, 2].map(
        (k) => Array.from(positions.subarray(3 * triangles[t + k], 3 * triangles[t + k] + 3)));
    six += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
        a[2] * (b[0] * c[1] - b[1] * c[0]);
    for (let k = 0; k < 3; ++k) {
      const edge = triangles[t + k] * 2 ** 26 + triangles[t + (k + 1) % 3];
      assert.ok(!edges.has(edge));
      edges.add(edge);
    }
  }
  for (const edge of edges)
    assert.ok(edges.has(edge % 2 ** 26 * 2 ** 26 + Math.floor(edge / 2 ** 26)));
  assert.ok(Math.abs(six / 6 / info.volume - 1) < 1e-12);
  asset.free();
});

test('patches and lenses add up', () => {
  const a = ist.Asset.from(bytesA), b = ist.Asset.from(bytesB), pose = {translation: [0, 0, 9]};
  const whole = ist.penetration(a, b, pose);
  const found = ist.contactPatches(a, b, pose, {maxPatches: 32});
  assert.ok(found.count > 16 && found.patches.length === found.count);
  assert.deepEqual(found.whole, whole);
  const sum = found.patches.reduce((s, p) => s + p.force[2], 0);
  assert.ok(Math.abs(sum - whole.force[2]) <= 1e-9 * whole.volume);
  const few = ist.contactPatches(a, b, pose, {maxPatches: 3, into: found});
  assert.ok(few === found && few.count === 3);

  const apart = ist.separation(a, b, {translation: [100, 0, 0]});
  assert.ok(
      apart.distanceMin > 0 && apart.distanceMin <= apart.distanceMax && apart.normal[0] > 0.9);
  const near = ist.separation(a, b, {translation: [100, 0, 0]}, {maxDistance: 1});
  assert.ok(near.distance === 1 && near.distanceMax === Infinity && Number.isNaN(near.normal[0]));
  assert.deepEqual(ist.separation(a, b, {translation: [100, 0, 0]}, {maxDistance: 100, pairId: 7}).pointA, apart.pointA);
  const spheresApart = ist.separation(a, b, {translation: [100, 0, 0]}, {innerSpheres: true});
  assert.ok(spheresApart.distance > apart.distance);  // they are inside
  assert.equal(ist.overlap(a, b, {translation: [100, 0, 0]}), 'no');
  assert.equal(ist.overlap(a, b, pose), 'yes');

  const lenses = ist.lenses(a, b, pose);
  const summed = ist.penetration(a, b, pose, {spheresOnly: true});
  assert.equal(lenses.total, summed.spherePairs);
  const spheres = a.spheres();
  for (let i = 0; i < lenses.count; ++i) {
    const [x, y, z, , , , radius, thickness, sphere] = lenses.data.subarray(10 * i);
    const [cx, cy, cz, r] = spheres.subarray(4 * sphere);
    assert.ok(Math.hypot(x - cx, y - cy, z - cz) <= r && radius <= r && thickness <= 2 * r);
  }
  const coarse = ist.lenses(a, b, pose, {detailA: 1, detailB: 1, maxLenses: 2, into: lenses});
  assert.ok(coarse === lenses && coarse.count === 2 && coarse.total < summed.spherePairs);
  a.free();
  b.free();
});

test('outlines: closed curves, a patch at a time', () => {
  const a = ist.Asset.from(bytesA), b = ist.Asset.from(bytesB), pose = {translation: [0, 0, 8.5]};
  const found = ist.overlapOutline(a, b, pose), {contact, count, segments, patch} = found;
  assert.ok(count > 1024 && segments.length === 6 * count && patch.length === count);
  const one = ist.contactPatches(a, b, pose, {measure: 'exact', maxPatches: 1});
  assert.deepEqual(contact.whole, one.whole);
  assert.deepEqual(contact.patches[0].force, one.patches[0].force);
  assert.equal(ist.contactPatches(a, b, pose, {measure: 'exact'}).count, 8);  // its octants
  const ends = (first) => Array.from(patch, (p, i) => [p, ...segments.subarray(6 * i + first, 6 * i + first + 3)].join());
  assert.deepEqual(ends(0).sort(), ends(3).sort());
  assert.ok(contact.count > 0 && patch.every((p) => p < contact.count));
  // Stokes: the force is the area that the outline encloses.
  const force = [0, 0, 0];
  for (let i = 0; i < count; ++i) {
    const [x, y, z, u, v, w] = segments.subarray(6 * i);
    [y * w - z * v, z * u - x * w, x * v - y * u].forEach((part, k) => force[k] += part / 2);
  }
  for (let k = 0; k < 3; ++k) assert.ok(Math.abs(force[k] - contact.whole.force[k]) < 1e-9);
  const apart = ist.overlapOutline(a, b, {translation: [100, 0, 0]}, {into: found});
  assert.ok(apart === found && apart.count === 0 && apart.contact.count === 0);
  const stopped = ist.overlapOutline(a, b, pose, {maxVisits: 1});
  assert.ok(stopped.contact.whole.status === 'budget-exhausted' && stopped.count === 0);

  const bare = ist.Asset.from(readFileSync(baked('nut', 500, {keepMesh: false})));
  const without = sentence(() => ist.overlapOutline(a, bare, pose));
  assert.match(without, /overlapOutline\(\): .*mesh/);
  assert.match(
      sentence(() => ist.overlapOutline(ist.Shape.ball(1), b, pose)), /a shape has no mesh/);
  a.free();
  b.free();
  bare.free();
});

test('poses and scales: the world may be moved', () => {
  const a = ist.Asset.from(bytesA), b = ist.Asset.from(bytesB);
  const half = Math.SQRT1_2;
  const still = ist.penetration(a, b, {translation: [0, 0, 9]});
  const moved = ist.penetration(
      a, b, {rotation: [half, 0, half, 0], translation: [9 + 5, 0, 0], scale: 1},
      {poseA: {rotation: [half, 0, half, 0], translation: [5, 0, 0]}});
  assert.ok(Math.abs(moved.volume / still.volume - 1) < 1e-9);
  assert.ok(Math.abs(moved.centroid[0] - 5 - still.centroid[2]) < 1e-9);
  const doubled = ist.penetration(a, b, {translation: [0, 0, 18], scale: 2}, {poseA: {scale: 2}});
  assert.ok(Math.abs(doubled.volume / still.volume / 8 - 1) < 1e-9);
  const limited = ist.penetration(a, b, {translation: [0, 0, 9]}, {maxVisits: 20});
  assert.equal(limited.status, 'budget-exhausted');
  assert.ok(limited.volumeMin <= still.volume && still.volume <= limited.volumeMax);
  a.free();
  b.free();
});

test('fields', () => {
  const b = ist.Asset.from(bytesB), {volume} = b.info(), {lower, upper} = b.bounds();
  const near = (x, wanted, share) =>
      assert.ok(Math.abs(x / wanted - 1) <= share, `${x} for ${wanted}`);
  const floor = ist.Shape.halfSpace([0, 0, 1], upper[2] + 1);
  near(ist.penetration(floor, b, {}).volume, volume, 1e-3);
  near(ist.separation(floor, b, {translation: [0, 0, 10 + upper[2] - lower[2]]}).distance, 9, 0.05);
  near(ist.penetration(ist.Shape.box([100, 100, 100]), b, {}).volume, volume, 1e-3);
  near(ist.penetration(ist.Shape.ball(100), b, {}).volume, volume, 1e-3);
  near(ist.penetration(ist.Shape.capsule(100, 1), b, {}).volume, volume, 1e-3);
  near(ist.penetration(ist.Shape.cylinder(100, 100), b, {}).volume, volume, 1e-3);
  const half = ist.Shape.halfSpace([0, 0, 1], 0), cut = ist.penetration(half, b, {}).volume;
  const ground = ist.Shape.heights(new Float32Array(16), 4, 4, [10, 10]);
  near(ist.penetration(ground, b, {}).volume, cut, 1e-9);
  const grid = new Float32Array(27).map((_, i) => 100 * (Math.floor(i / 9) - 1));  // z
  near(
      ist.penetration(
             ist.Shape.distanceGrid(grid, [3, 3, 3], 100, {origin: [-100, -100, -100]}), b, {})
          .volume,
      cut, 1e-6);
  assert.ok(ist.contactPatches(half, b, {}).count > 1);
  assert.equal(ist.overlap(half, b, {}), 'yes');
  assert.match(sentence(() => ist.lenses(half, b, {})), /a shape has no spheres/);
  half.free();
  assert.match(sentence(() => ist.penetration(half, b, {})), /used after free/);
  assert.match(sentence(() => ist.penetration(ist.Shape.ball(-1), b, {})), /radius is -1; it must be > 0/);
  assert.match(
      sentence(() => ist.Shape.heights(new Float32Array(3), 2, 2, [1, 1])),
      /2 · 2 = 4 numbers, not 3/);
  assert.match(
      sentence(() => ist.Shape.heights(new Float32Array(3), 3, 1, [1, 1])), /at least two points/);
  b.free();
});

test('flat faces: what protrudes is taken out', () => {
  const a = ist.Asset.from(readFileSync(baked('cube', 1000))), b = a;
  const gap = a.info().protrusion / 2, {lower, upper} = a.bounds();
  const pose = {translation: [0, 0, upper[2] - lower[2] + gap]}, options = {spheresOnly: true};
  const whole = ist.penetration(a, b, pose, options);
  assert.ok(whole.volume > 0, 'spheres stick out across the gap');
  const clean = ist.withoutProtrusion(whole, a, b, pose);
  assert.ok(clean.volume < 0.3 * whole.volume && clean.volumeMin <= clean.volume);
  assert.ok(Math.abs(clean.force[2]) < Math.abs(whole.force[2]));
  const patches = ist.contactPatches(a, b, pose, options);
  const before = patches.patches.reduce((sum, p) => sum + p.volume, 0), {count} = patches;
  assert.equal(ist.patchesWithoutProtrusion(patches, a, b, pose, options), patches);
  assert.ok(patches.count === count);
  assert.ok(patches.patches.reduce((sum, p) => sum + p.volume, 0) < 0.5 * before);
  assert.equal(ist.withoutProtrusion(whole, a, b, pose, {into: whole}), whole);
  assert.deepEqual(whole, clean);
  assert.match(
      sentence(() => ist.withoutProtrusion(whole, ist.Shape.ball(1), b, pose)),
      /both solids must be Assets/);
  assert.match(
      sentence(() => ist.patchesWithoutProtrusion({count: 3, patches: []}, a, b, pose)),
      /the result of contactPatches\(\)/);
  a.free();
});

test('wrenches about any point, and how two assets suit', () => {
  const a = ist.Asset.from(bytesA), b = ist.Asset.from(bytesB), pose = {translation: [0, 0, 9]};
  const contact = ist.penetration(a, b, pose);
  const about = [0, 0, 9], {onA, onB} = ist.wrenches(contact, pose, {b: about});
  for (let k = 0; k < 3; ++k) {
    assert.equal(onB.force[k], contact.force[k]);
    assert.equal(onA.force[k], -onB.force[k]);
    assert.ok(Math.abs(onB.torque[k] - contact.torque[k]) < 1e-9);  // B's origin lies there
  }
  const found = ist.contactPatches(a, b, pose), into = {onA, onB};
  assert.equal(ist.wrenches(found.patches[0], pose, {b: about}, into), into);
  assert.equal(onB.force[2], found.patches[0].force[2]);
  const fit = ist.sizeMatch(a, b);
  assert.ok(fit.fits && fit.ratio >= 1 && fit.featureSizeA > 0);
  const small = {scale: 0.01, translation: [4, 0, 10]}, unlike = ist.sizeMatch(a, b, {scaleB: 0.01});
  assert.ok(unlike.needsMesh && unlike.hasMesh && unlike.fits);
  // The meshes answer in this case, unless only spheres are requested.
  const meshes = ist.penetration(a, b, small, {measure: 'exact'}).volume;
  assert.equal(ist.penetration(a, b, small).volume, meshes);
  assert.notEqual(ist.penetration(a, b, small, {spheresOnly: true}).volume, meshes);
  a.free();
  b.free();
});

test('time of impact: no tunnelling at any speed', () => {
  const b = ist.Asset.from(bytesB), {lower, upper} = b.bounds();
  const floor = ist.Shape.halfSpace([0, 0, 1], 0);
  const start = {translation: [0, 0, 10 - lower[2]]};
  for (const speed of [1, 1e3, 1e6]) {
    const hit = ist.timeOfImpact(
        floor, b, start, {motionB: {velocity: [0, 0, -speed]}, duration: 100 / speed});
    assert.equal(hit.kind, 'impact');
    assert.ok(hit.time * speed < 10 && hit.time * speed > 10 - 0.01 * (upper[2] - lower[2]));
    assert.ok(hit.distanceMin <= hit.distanceMax && hit.distanceMax < 0.1 && hit.normal[2] > 0.99);
  }
  const away = ist.timeOfImpact(floor, b, start, {motionB: {velocity: [0, 0, 1]}});
  assert.ok(away.kind === 'none' && away.time === 1);
  const a = ist.Asset.from(bytesA);
  const inside = ist.timeOfImpact(a, b, {translation: [0, 0, 9]});
  assert.ok(inside.kind === 'overlapping' && inside.time === 0);
  assert.equal(ist.timeOfImpact(a, b, start, {maxVisits: 1, into: away}), away);

  const to = {rotation: [Math.SQRT1_2, 0, 0, Math.SQRT1_2], translation: [1, 2, 3]};
  const motion = ist.motionBetween({}, to, 4);
  assert.ok(Math.abs(motion.angularVelocity[2] - Math.PI / 8) < 1e-12);
  const there = ist.moved({}, motion, 4);
  assert.ok(Math.abs(there.rotation[3] - Math.SQRT1_2) < 1e-12 && there.translation[2] === 3);
  assert.match(sentence(() => ist.motionBetween({}, to, 0)), /duration is 0; it must be > 0/);
  assert.match(
      sentence(() => ist.timeOfImpact(a, b, {}, {motionA: {velocity: [0, 0]}})),
      /motionA\.velocity has 2 numbers, not 3/);
  assert.match(
      sentence(() => ist.timeOfImpact(a, b, {}, {motionA: {velocity: [NaN, 0, 0]}})),
      /out of range/);
  a.free();
  b.free();
});

test('a batch: the answers of single calls, a bad pair among them', () => {
  const a = ist.Asset.from(bytesA), b = ist.Asset.from(bytesB),
        floor = ist.Shape.halfSpace([0, 0, 1]);
  const pairs = [];
  for (let i = 0; i < 20; ++i) {
    const poseB = {translation: [0.1 * i, 0, i === 7 ? NaN : 9]};
    pairs.push(i % 3 ? {a, b, poseB} : {a: floor, b, poseA: {scale: 2}, poseB});
  }
  const options = {maxPatches: 5}, answers = ist.penetrationBatch(pairs);
  const patches = ist.contactPatchesBatch(pairs, options);
  pairs.forEach(({a, b, poseA, poseB}, i) => {
    if (i === 7) {
      assert.ok(answers[i].status === 'invalid-input' && Number.isNaN(answers[i].volume));
      assert.ok(patches[i].whole.status === 'invalid-input' && patches[i].count === 0);
      return;
    }
    assert.deepEqual(answers[i], ist.penetration(a, b, poseB, {poseA}));
    assert.deepEqual(patches[i], ist.contactPatches(a, b, poseB, {poseA, ...options}));
  });
  const kept = [...answers];
  assert.equal(ist.penetrationBatch(pairs.slice(0, 4), {into: answers}), answers);
  assert.ok(answers.length === 4 && answers.every((answer, i) => answer === kept[i]));
  assert.deepEqual(ist.penetrationBatch([]), []);
  assert.match(
      sentence(() => ist.penetrationBatch([pairs[0], {a, b}])), /pair 1: poseB is missing/);
  assert.match(
      sentence(() => ist.contactPatchesBatch([{a, b: {}, poseB: {}}])),
      /pair 0: contactPatchesBatch\(\): solid B must be an Asset or a Shape/);
  a.free();
  b.free();
});

test('what is wrong is said', () => {
  const a = ist.Asset.from(bytesA, 'bolt.ist'), b = ist.Asset.from(bytesB);
  const ask = (pose, options) => () => ist.penetration(a, b, pose, options);
  assert.match(sentence(ask()), /poseB is missing/);
  assert.match(
      sentence(ask({rotation: [0, 0, 0, 0]})), /penetration\(\): a pose, .* is out of range/);
  assert.equal(ask({rotation: [2, 0, 0, 0]})().volume, ask({rotation: [1, 0, 0, 0]})().volume);
  assert.match(sentence(ask({rotation: [1, 0, 0]})), /poseB\.rotation has 3 numbers, not 4/);
  assert.match(sentence(ask({translation: [NaN, 0, 0]})), /out of range/);
  assert.match(sentence(ask({translation: ['1', 0, 0]})), /not a number/);
  assert.match(sentence(ask({scale: 0})), /scale is 0; it must be > 0/);
  assert.match(sentence(ask({}, {measure: 'outer'})), /measure is outer/);
  assert.match(sentence(ask({}, {pairBudget: -1})), /whole number/);
  assert.match(sentence(() => ist.penetration({}, b, {})), /solid A must be an Asset or a Shape/);
  assert.match(
      sentence(() => ist.penetration(ist.Shape.ball(2), ist.Shape.ball(1), {})),
      /both solids are shapes/);
  const floor = ist.Shape.halfSpace([0, 0, 1], 1);
  assert.equal(ist.penetration(a, floor, {}).volume, ist.penetration(floor, a, {}).volume);
  assert.match(sentence(() => ist.lenses(a, floor, {})), /solid B must be an Asset: a shape/);
  assert.match(sentence(() => ist.contactPatches(a, b, {}, {maxPatches: 33})), /from 1 to 32/);
  assert.match(sentence(() => new ist.Asset()), /Asset has no public constructor; .*static functions/);
  assert.match(sentence(ask({}, {relativeError: -1})), /relativeError is -1; it must be ≥ 0/);
  assert.match(sentence(ask({}, {relativeError: NaN})), /relativeError is NaN/);
  const asked = (options) => () => ist.separation(a, b, {}, options);
  assert.match(sentence(asked({maxDistance: -1})), /maxDistance is -1; it must be ≥ 0/);
  assert.match(sentence(() => ist.sizeMatch(a, b, {scaleA: 0})), /scaleA is 0; it must be > 0/);
  assert.match(sentence(() => ist.Shape.ball()), /radius is undefined; it must be > 0/);
  assert.match(sentence(() => ist.Shape.box([1, 1, 0])), /halfExtents\[2\] is 0; it must be > 0/);
  assert.match(sentence(() => ist.Shape.halfSpace([0, 0, 0])), /length of normal is 0/);
  assert.match(sentence(() => ist.Shape.capsule(1)), /halfHeight is undefined, not a number/);
  assert.match(sentence(() => ist.Shape.capsule(1, -1)), /halfHeight is -1; it must be ≥ 0/);
  assert.match(sentence(() => ist.Shape.heights([1, 2, 3, 4], 2, 2, [1, 1])), /a Float32Array of 2 · 2 = 4 numbers$/);
  assert.match(sentence(() => ist.Shape.heights(new Float32Array([0, NaN, 0, 0]), 2, 2, [1, 1])), /finite/);
  a.free();
  a.free();
  assert.match(sentence(ask({})), /bolt\.ist was used after free\(\)/);
  assert.match(sentence(() => a.info()), /used after free\(\)/);
  b.free();
});

test('a member of a pose or a motion that is misspelt is refused by its name', () => {
  const a = ist.Asset.from(bytesA), b = ist.Asset.from(bytesB), scene = new ist.Scene();
  const refused = (call, words) =>
      assert.throws(call, (error) => error instanceof TypeError && words.test(error.message));
  refused(() => ist.penetration(a, b, {position: [0, 0, 9]}), /poseB: no member is called position; there are rotation,/);
  refused(() => ist.penetration(a, b, {}, {poseA: {quaternion: [1, 0, 0, 0]}}), /poseA: .* quaternion/);
  refused(() => ist.penetration(a, b, [1, 0, 0, 0, 0, 0, 9]), /poseB: no member is called 0/);
  refused(() => ist.penetration(a, b, 9), /poseB is 9, not an object/);
  refused(() => ist.penetrationBatch([{a, b, poseB: {at: [0, 0, 9]}}]), /pair 0: .*poseB: .* at;/);
  refused(() => ist.timeOfImpact(a, b, {}, {motionB: {linear: [1, 0, 0]}}), /motionB: .* linear; there are velocity,/);
  refused(() => scene.add(a, {place: [0, 0, 0]}), /pose: .* place/);
  scene.add(a);
  refused(() => scene.setPoses([0], [{place: [0, 0, 0]}]), /pose: .* place/);
  scene.setPoses([0], [ist.moved({}, {velocity: [1, 0, 0]}, 1)]);
  scene.free();
  a.free();
  b.free();
});

test('an option that is misspelt is refused by its name', async () => {
  const a = ist.Asset.from(bytesA), b = ist.Asset.from(bytesB), floor = ist.Shape.halfSpace([0, 0, 1]);
  const whole = ist.penetration(a, b, {}), found = ist.contactPatches(a, b, {});
  const calls = {
    'Asset.spheres': (typo) => a.spheres(typo),
    'Shape.distanceGrid': (typo) =>
        ist.Shape.distanceGrid(new Float32Array(8), [2, 2, 2], 1, typo),
    penetration: (typo) => ist.penetration(a, b, {}, typo),
    separation: (typo) => ist.separation(floor, b, {}, typo),
    contactPatches: (typo) => ist.contactPatches(a, b, {}, typo),
    overlap: (typo) => ist.overlap(a, b, {}, typo),
    overlapOutline: (typo) => ist.overlapOutline(a, b, {}, typo),
    lenses: (typo) => ist.lenses(a, b, {}, typo),
    raycast: (typo) => ist.raycast(a, {}, [0, 0, 0], [1, 0, 0], typo),
    closestPoint: (typo) => ist.closestPoint(a, {}, [0, 0, 0], typo),
    contains: (typo) => ist.contains(a, {}, [0, 0, 0], typo),
    withoutProtrusion: (typo) => ist.withoutProtrusion(whole, a, b, {}, typo),
    patchesWithoutProtrusion: (typo) => ist.patchesWithoutProtrusion(found, a, b, {}, typo),
    wrenches: (typo) => ist.wrenches(whole, {}, typo),
    sizeMatch: (typo) => ist.sizeMatch(a, b, typo),
    timeOfImpact: (typo) => ist.timeOfImpact(a, b, {}, typo),
    penetrationBatch: (typo) => ist.penetrationBatch([], typo),
    contactPatchesBatch: (typo) => ist.contactPatchesBatch([], typo),
  };
  for (const [name, call] of Object.entries(calls))
    assert.throws(() => call({Measure: 1}), {
      name: 'TypeError',
      message: new RegExp(`^ist: ${name}\\(\\): no option is called Measure; there are \\w+`),
    });
  await assert.rejects(ist.init({Wasm: ''}), {name: 'TypeError', message: /init\(\): .* wasm$/});
  assert.throws(() => ist.penetrationBatch([], {poseA: {}}), TypeError);  // each pair has its own
  for (const each of [a, b, floor]) each.free();
});

test('memory comes back', () => {
  const freed = () => {
    for (let i = 0; i < 50; ++i) {
      const asset = ist.Asset.from(bytesA);
      ist.Shape.heights(new Float32Array(1e4), 100, 100, [1, 1]).free();
      asset.mesh();
      asset.free();
      assert.throws(() => ist.Asset.from(bytesA.subarray(1)));
    }
  };
  freed();
  const before = process.memoryUsage().arrayBuffers + process.memoryUsage().external;
  freed();
  const b = ist.Asset.from(bytesB);  // after growing, the next query sees the new memory
  assert.ok(ist.penetration(b, b, {translation: [0.1, 0, 0]}).volume > 0);
  assert.ok(process.memoryUsage().arrayBuffers + process.memoryUsage().external < before + 5e7);
  b.free();
});

test('assets that nobody refers to are released', async () => {
  const script = `
    import {readFileSync} from 'node:fs';
    import * as ist from 'ist-query';
    await ist.init();
    const bytes = readFileSync(${JSON.stringify(pathA)});
    for (let i = 0; i < 8000; ++i) {  // 5 GB
      ist.Asset.from(bytes);
      if (i % 200 == 0) { gc(); await new Promise((next) => setTimeout(next, 1)); }
    }
    console.log('all');`;
  const told = execFileSync(
      process.execPath, ['--expose-gc', '--input-type=module', '-e', script],
      {cwd: packageFolder, encoding: 'utf8'});
  assert.equal(told.trim(), 'all');
});

test('a loop that keeps its answers makes no garbage', () => {
  const script = `
    import {readFileSync} from 'node:fs';
    import * as ist from 'ist-query';
    await ist.init();
    const a = ist.Asset.from(readFileSync(${
      JSON.stringify(pathA)})), b = ist.Asset.from(readFileSync(${JSON.stringify(pathB)}));
    const pose = {rotation: [1, 0, 0, 0], translation: [0, 0, 9], scale: 1};
    const options = {}, gaps = {}, parts = {maxPatches: 8};
    const step = (i) => {
      pose.translation[2] = 9 + 1e-4 * (i % 1000);
      options.into = ist.penetration(a, b, pose, options);
      gaps.into = ist.separation(a, b, pose, gaps);
      parts.into = ist.contactPatches(a, b, pose, parts);
    };
    for (let i = 0; i < 3000; ++i) step(i);
    let least = Infinity;  // the compiler's own memory comes once, garbage in every round
    for (let round = 0; round < 5; ++round) {
      gc();
      const before = process.memoryUsage().heapUsed;
      for (let i = 0; i < 1000; ++i) step(i);
      least = Math.min(least, (process.memoryUsage().heapUsed - before) / 1000);
    }
    console.log(least);`;
  const told = execFileSync(
      process.execPath,
      ['--expose-gc', '--max-semi-space-size=64', '--input-type=module', '-e', script],
      {cwd: packageFolder, encoding: 'utf8'});
  assert.ok(Number(told) < 50, `${told.trim()} bytes a step`);
});

test('rays and points against one solid', () => {
  const bolt = ist.Asset.from(bytesA, 'bolt'), ball = ist.Shape.ball(2);
  const {lower, upper, centre} = bolt.bounds();
  // Up the bolt's axis, from below and from inside: to its end, and out of its head.
  const pose = {rotation: [1, 0, 0, 0], translation: [10, 0, 0]};
  const below = [10, 0, lower[2] - 3], inside = [10, 0, centre[2]], up = [0, 0, 5];
  const hits = ist.raycast(bolt, pose, [...below, ...inside], up);
  assert.equal(hits.count, 2);
  assert.ok(Math.abs(hits.distance[0] - 3) < 1e-9, `${hits.distance}`);
  assert.ok(Math.abs(hits.point[5] - upper[2]) < 1e-9, `${hits.point}`);
  assert.deepEqual(Array.from(hits.normal), [0, 0, -1, 0, 0, 1]);
  const short = ist.raycast(bolt, pose, below, up, {maxDistance: 2, into: hits});
  assert.equal(short, hits);
  assert.ok(short.count === 1 && short.distance[0] === Infinity);
  assert.equal(short.triangle[0], 2 ** 32 - 1);

  assert.deepEqual(Array.from(ist.contains(bolt, pose, [...below, ...inside])), [0, 1]);
  const feet = ist.closestPoint(bolt, pose, [...below, ...inside]);
  assert.ok(Math.abs(feet.distance[0] - 3) < 1e-9 && feet.distance[1] < 0);
  assert.ok(feet.error.every((error) => error >= 0 && error < 1e-6));
  assert.deepEqual(Array.from(feet.gradient.subarray(0, 3)), [0, 0, -1]);

  // Shapes: NaN among many points, an error for one alone.
  const many = ist.closestPoint(ball, {}, [3, 0, 0, NaN, 0, 0]);
  assert.deepEqual(Array.from(many.distance), [1, NaN]);
  assert.deepEqual(Array.from(ist.contains(ball, {}, [1, 0, 0, NaN, 0, 0])), [1, 2]);
  assert.match(sentence(() => ist.closestPoint(ball, {}, [NaN, 0, 0])), /closestPoint\(\): /);
  assert.match(sentence(() => ist.raycast(ball, {}, [0, 0, 9], [0, 0, 0])), /raycast\(\): /);
  assert.equal(ist.raycast(ball, {}, [0, 0, 9], [0, 0, -1]).distance[0], 7);
  assert.match(
      sentence(() => ist.contains(bolt, {}, [1, 2])), /points has 2 numbers; .* three a row/);
  assert.match(
      sentence(() => ist.raycast(bolt, {}, [0, 0, 0, 0, 0, 0], [1, 0, 0, 1, 0, 0, 1, 0, 0])),
      /directions has 3 rows; origins has 2/);
  assert.match(sentence(() => ist.contains(bolt, {}, ['1', 2, 3])), /points holds 1, not a number/);
  assert.match(
      sentence(() => ist.raycast(bolt, {}, below, up, {maxDistance: 0})), /maxDistance is 0; it must be > 0/);
  assert.match(sentence(() => ist.contains(pose, {}, below)), /must be an Asset or a Shape/);
  const bare = ist.Asset.from(readFileSync(baked('nut', 500, {keepMesh: false})), 'bare');
  assert.match(
      sentence(() => ist.contains(bare, {}, [...below, ...inside])), /lacks data that the query needs/);
  for (const each of [bolt, ball, bare]) each.free();
});

test('a scene: pairs, events and answers are those of single calls', () => {
  const bolt = ist.Asset.from(bytesA, 'bolt'), nut = ist.Asset.from(bytesB, 'nut');
  const floor = ist.Shape.halfSpace([0, 0, 1]);
  const scene = new ist.Scene({maxBodies: 8, maxPairs: 16});
  scene.setRule(0, 0, {measure: 'exact', margin: 1});
  const poses = [{}, {translation: [0, 0, 9]}, {translation: [0.2, 0, 40]}, {translation: [300, 0, 0]}];
  const solids = [bolt, nut, nut, bolt];
  solids.forEach((solid, i) => assert.equal(scene.add(solid, poses[i]), i));
  scene.setRule(0, 1, {answer: 'overlap'});
  assert.equal(scene.add(floor, undefined, {number: 20, moves: false, group: 1}), 20);
  assert.equal(scene.size, 5);
  const first = scene.step();
  const named = (step) => step.pairs.slice(0, step.count).map(({a, b}) => [a, b]);
  for (let a = 0; a < 4; ++a)
    for (let b = a + 1; b < 4; ++b) {
      const options = {measure: 'exact', poseA: poses[a]};
      const alone = ist.penetration(solids[a], solids[b], poses[b], options);
      const gap = ist.separation(solids[a], solids[b], poses[b], {poseA: poses[a]});
      const pair = first.pairs.slice(0, first.count).find((pair) => pair.a === a && pair.b === b);
      assert.equal(pair !== undefined, alone.volume > 0 || gap.distance < 1, `${a} ${b}`);
      if (pair === undefined) continue;
      assert.deepEqual(pair.penetration, alone);
      assert.ok(pair.begins);
      if (alone.volume === 0) assert.equal(pair.separation.distance, gap.distance);
    }
  assert.ok(named(first).some(([a, b]) => a === 0 && b === 1));
  const onFloor = first.pairs.slice(0, first.count).filter((pair) => pair.b === 20);
  assert.ok(onFloor.length > 0 && onFloor.every((pair) => pair.overlapping !== 'no'));
  // Moved away: the pair ends; the answer is written into the one given.
  scene.setPoses([1], [{translation: [0, 500, 0]}]);
  const second = scene.step({into: first});
  assert.equal(second, first);
  assert.deepEqual(Array.from(second.ended.subarray(0, 2)), [0, 1]);
  assert.ok(second.pairs.slice(0, second.count).every((pair) => !pair.begins || pair.a === 1));
  scene.setPoses([1], [{translation: [NaN, 0, 0]}]);
  assert.deepEqual(Array.from(scene.step().refused), [1]);
  scene.setPoses([1], [{translation: [0, 0, 9]}]);
  scene.exclude(0, 1);
  assert.ok(!named(scene.step()).some(([a, b]) => a === 0 && b === 1));
  scene.include(0, 1);
  assert.ok(named(scene.step()).some(([a, b]) => a === 0 && b === 1));

  const hits = scene.raycast([300, 0.01, 900, 150, 0, 900], [0, 0, -1]);
  assert.deepEqual(Array.from(hits.number), [3, 20]);
  const near = scene.nearest([300, 0, 60, 150, 0, 900], {maxDistance: 100});
  const alone = ist.closestPoint(bolt, poses[3], [300, 0, 60]);
  assert.equal(near.number[0], alone.distance[0] < 60 ? 3 : 20);
  assert.ok(near.distance[1] === Infinity);
  assert.ok(scene.nearest([NaN, 0, 0, 300, 0, 60]).distance.every((x, i) => isNaN(x) === (i === 0)));
  assert.match(sentence(() => scene.nearest([NaN, 0, 0])), /Scene.nearest\(\): /);
  assert.match(sentence(() => scene.raycast([0, 0, 0], [0, 0, 0])), /Scene.raycast\(\): /);

  assert.match(sentence(() => bolt.free()), /2 bodies of a Scene are made of it/);
  assert.match(sentence(() => scene.add(nut, {}, {number: 3})), /body 3: /);
  assert.match(sentence(() => scene.remove(9)), /body 9: /);
  assert.match(sentence(() => scene.setPoses([1, 2], [{}])), /2 numbers and 1 poses/);
  assert.match(sentence(() => scene.setRule(0, 0, {answer: 'all'})), /use one of penetration, nothing/);
  assert.match(sentence(() => scene.setRule(0, 8)), /groupB is 8; it must be a whole number from 0 to 7/);
  assert.match(sentence(() => scene.setRule(0, 0, {margin: -1})), /margin is -1; it must be ≥ 0/);
  assert.match(sentence(() => scene.add(nut, {}, {group: 8})), /group is 8/);
  assert.match(sentence(() => new ist.Scene({maxPairs: 0})), /maxPairs is 0; it must be a whole number from 1/);
  const small = new ist.Scene({maxBodies: 3, maxPairs: 1});
  small.setRule(0, 0, {answer: 'boxes'});
  for (let i = 0; i < 3; ++i) small.add(nut);
  assert.match(sentence(() => small.step()), /larger maxPairs/);
  assert.match(sentence(() => small.add(nut)), /body 3: /);
  small.free();
  scene.remove(3);
  scene.free();
  scene.free();
  assert.match(sentence(() => scene.step()), /used after free/);
  bolt.free();
  nut.free();
});
