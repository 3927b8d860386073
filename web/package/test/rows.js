// Answers of every query of a table of poses, as bits, in the format of tests/c_api/native_rows.c.
// For Node and pages.

const buffer = new DataView(new ArrayBuffer(8));
function hex(number) {
  buffer.setFloat64(0, number);
  return buffer.getUint32(0).toString(16).padStart(8, '0') +
      buffer.getUint32(4).toString(16).padStart(8, '0');
}
const hexes = (numbers) => Array.from(numbers, hex);
const row = (numbers, i) => numbers.subarray(3 * i, 3 * i + 3);

/** Rows of a pose table of the oracle. */
export function parseRows(csv) {
  return csv.trim().split('\n').slice(1).map((line) => {
    const [, , , , w, x, y, z, tx, ty, tz, scale] = line.split(',').map(Number);
    return {rotation: [w, x, y, z], translation: [tx, ty, tz], scale};
  });
}

const kStatus = {
  'ok': 0,
  'budget-exhausted': 1,
  'error-exceeded': 2
};

function penetrationBits(p) {
  return [
    kStatus[p.status],
    ...hexes([p.volume, p.volumeMin, p.volumeMax, ...p.centroid]),
    ...hexes(p.force),
    ...hexes(p.torque),
    p.nodeVisits,
    p.spherePairs,
  ];
}

const patchBits = (patches) => patches.flatMap(
    (p) =>
        [p.id,
         ...hexes(p.centroid),
         ...hexes(p.normal),
         ...hexes([p.area, p.depth, p.volume]),
         ...hexes(p.force),
         ...hexes(p.torque),
]);

/** The queries of tests/c_api/native_rows.c under the same names. */
function moreQueries(ist, a, b, halfSpace) {
  const identity = {};
  return {
    'without protrusion': {
      ask: (pose) =>
          ist.withoutProtrusion(ist.penetration(a, b, pose, {spheresOnly: true}), a, b, pose),
      bits: penetrationBits,
    },
    'patches without protrusion': {
      ask: (pose) => {
        const options = {spheresOnly: true, maxPatches: 16};
        const found = ist.contactPatches(a, b, pose, options);
        return ist.patchesWithoutProtrusion(found, a, b, pose, options);
      },
      bits: (found) => patchBits(found.patches.slice(0, found.count)),
    },
    'fit': {
      ask: (pose) => ist.sizeMatch(a, b, {scaleB: pose.scale}),
      bits: (f) =>
          [...hexes([f.featureSizeA, f.featureSizeB, f.ratio]), Number(f.aIsCoarser), Number(f.hasMesh),
           Number(f.needsMesh), Number(f.fits)],
    },
    'wrenches': {
      ask: (pose) => ist.wrenches(
          ist.penetration(a, b, pose), pose, {a: [0.1, 0.2, 0.3], b: [-0.3, 0.2, 0.1]}),
      bits: ({onA, onB}) => [onA, onB].flatMap((w) => [...hexes(w.force), ...hexes(w.torque)]),
    },
    'motions': {
      ask: ({rotation, translation, scale}) => {
        const from = {scale};
        const motion = ist.motionBetween(from, {rotation, translation}, 0.5, [0.1, -0.2, 0.3]);
        return [motion, ist.moved(from, motion, 0.2)];
      },
      bits: ([motion, there]) => [motion.velocity, motion.angularVelocity, motion.about,
                                  there.rotation, there.translation]
                                     .flatMap(hexes),
    },
    'impact': {
      ask: (pose) => ist.timeOfImpact(a, b, pose, {
        motionA: {angularVelocity: [0, 0.25, 0]},
        motionB: {velocity: pose.translation.map((x) => -2 * x), angularVelocity: [0.5, 0, 0.25]},
        maxVisits: 20000,
        duration: 0.5,
      }),
      bits: (t) =>
          [kStatus[t.status],
           ['none', 'impact', 'unresolved', 'overlapping'].indexOf(t.kind),
           ...hexes([t.time, t.distanceMin, t.distanceMax]),
           ...hexes(t.pointA),
           ...hexes(t.pointB),
           ...hexes(t.normal),
           t.nodeVisits,
           t.surfacePairs,
  ],
    },
    'batches': {
      ask: (pose) => {
        const pair = {a, b, poseB: pose};
        const turned = {a: b, b: a, poseA: pose, poseB: identity};
        return [
          ist.penetrationBatch([pair, turned, {a: halfSpace, b, poseB: pose}]),
          ist.contactPatchesBatch([pair], {maxPatches: 16})[0]
        ];
      },
      bits: ([
        answers, {whole, patches, count}
      ]) => [...answers, whole].flatMap(penetrationBits).concat(patchBits(patches.slice(0, count))),
    },
  };
}

/** By name: the query of a row, which returns its answer as bits. `ist`: a build of the package. */
export function queries(ist, a, b) {
  const halfSpace = ist.Shape.halfSpace([0, 0.6, 0.8], 0.0625);
  const box = ist.Shape.box([0.25, 0.5, 0.125]);
  const capsule = ist.Shape.capsule(0.25, 0.375);
  const penetrationOf = (solid, options = {}) => {
    const reused = {...options, into: undefined};
    return {
      ask: (pose) => reused.into = ist.penetration(solid, b, pose, reused),
      bits: penetrationBits,
    };
  };
  const forSeparation = {into: undefined}, forPatches = {maxPatches: 16, into: undefined},
        forOutline = {maxPatches: 16, into: undefined};
  return {
    'matched': penetrationOf(a),
    'spheres only': penetrationOf(a, {spheresOnly: true}),
    'exact': penetrationOf(a, {measure: 'exact'}),
    'inner': penetrationOf(a, {measure: 'inner'}),
    'budget': penetrationOf(a, {pairBudget: 200, maxVisits: 300}),
    'half-space': penetrationOf(halfSpace),
    'box': penetrationOf(box),
    'capsule': penetrationOf(capsule),
    'separation': {
      ask: (pose) => forSeparation.into = ist.separation(a, b, pose, forSeparation),
      bits: (s) =>
          [kStatus[s.status],
           ...hexes([s.distance, s.distanceMin, s.distanceMax]),
           ...hexes(s.pointA),
           ...hexes(s.pointB),
           ...hexes(s.normal),
           s.nodeVisits,
           s.spherePairs,
  ],
    },
    'patches': {
      ask: (pose) => forPatches.into = ist.contactPatches(a, b, pose, forPatches),
      bits: (found) =>
          penetrationBits(found.whole).concat(patchBits(found.patches.slice(0, found.count))),
    },
    'outline': {
      ask: (pose) => forOutline.into = ist.overlapOutline(a, b, pose, forOutline),
      bits: ({contact: {whole, patches, count: some}, count, segments, patch}) => {
        const bits = penetrationBits(whole).concat(patchBits(patches.slice(0, some)));
        for (let i = 0; i < count; i += 7)
          bits.push(...hexes(segments.subarray(6 * i, 6 * i + 6)), patch[i]);
        return bits;
      },
    },
    'rays': {
      ask: (pose) => {
        const [x, y, z] = pose.translation, origin = [2 * x, 2 * y, 2 * z];
        return [
          ist.raycast(b, pose, origin, [-x, -y, -z, 0.125 - x, -y, -z]),
          ist.raycast(b, pose, origin, [-0.03125 - x, -y, -z], {maxDistance: 100}),
        ];
      },
      bits: (answers) => answers.flatMap(
          ({count, triangle, distance, point, normal}) => Array.from({length: count}, (_, i) => [
                                                            triangle[i],
                                                            hex(distance[i]),
                                                            ...hexes(row(point, i)),
                                                            ...hexes(row(normal, i)),
          ]).flat()),
    },
    'points': {
      ask: (pose) => {
        const [x, y, z] = pose.translation;
        const points = [x, y, z, x + 0.25, y, z, x, y + 0.0625, z];
        return [[b, pose], [halfSpace, {}]].map(
            ([solid, at]) =>
                [ist.contains(solid, at, points), ist.closestPoint(solid, at, points)]);
      },
      bits: (answers) => answers.flatMap(
          ([inside, {count, triangle, distance, error, point, gradient}]) =>
              Array.from({length: count}, (_, i) => [
                inside[i],
                triangle[i],
                ...hexes([distance[i], error[i]]),
                ...hexes(row(point, i)),
                ...hexes(row(gradient, i)),
          ]).flat()),
    },
    'overlap': {
      ask: (pose) => ist.overlap(a, b, pose),
      bits: (answer) => [['no', 'yes', 'unknown'].indexOf(answer)],
    },
    'lenses': {
      ask: (pose) => ist.lenses(a, b, pose, {maxLenses: 8}),
      bits: ({total, count, data}) => {
        const bits = [total];
        for (let i = 0; i < count; ++i)
          bits.push(
              ...hexes(data.subarray(10 * i, 10 * i + 8)), data[10 * i + 8], data[10 * i + 9]);
        return bits;
      },
    },
    ...moreQueries(ist, a, b, halfSpace),
  };
}

/** All answers in the format of native_rows. */
export function rowsText(ist, bytesA, bytesB, csv) {
  const a = ist.Asset.from(bytesA, 'A'), b = ist.Asset.from(bytesB, 'B');
  const asked = Object.entries(queries(ist, a, b));
  const lines = parseRows(csv).flatMap(
      (pose, i) => asked.map(
          ([name, {ask, bits}]) => `${i} ${[`${name}:`, ...bits(ask(pose))].join(' ')}\n`));
  a.free();
  b.free();
  return lines.join('');
}

/** Mean time [µs] of each query over all rows, of the best of so many passes. */
export function rowTimes(ist, bytesA, bytesB, csv, passes) {
  const a = ist.Asset.from(bytesA, 'A'), b = ist.Asset.from(bytesB, 'B');
  const rows = parseRows(csv), times = {};
  for (const [name, {ask}] of Object.entries(queries(ist, a, b))) {
    times[name] = Infinity;
    for (let pass = 0; pass < passes; ++pass) {
      // A browser's clock is as coarse as 100 µs.
      const start = performance.now();
      let asked = 0, time;
      do {
        for (const pose of rows) ask(pose);
        asked += rows.length;
        time = performance.now() - start;
      } while (time < 5);
      times[name] = Math.min(times[name], 1000 * time / asked);
    }
  }
  a.free();
  b.free();
  return times;
}
