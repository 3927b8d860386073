// Every query of a table of poses, as bits: what tests/c_api/native_rows.c prints. For Node and
// pages.

const buffer = new DataView(new ArrayBuffer(8));
function hex(number) {
  buffer.setFloat64(0, number);
  return buffer.getUint32(0).toString(16).padStart(8, '0') +
      buffer.getUint32(4).toString(16).padStart(8, '0');
}
const hexes = (numbers) => Array.from(numbers, hex);
const negated = (numbers) => Array.from(numbers, (x) => hex(-x));

/** Rows of a pose table of the oracle. */
export function parseRows(csv) {
  return csv.trim().split('\n').slice(1).map((line) => {
    const [, , , , w, x, y, z, tx, ty, tz, scale] = line.split(',').map(Number);
    return {rotation: [w, x, y, z], translation: [tx, ty, tz], scale};
  });
}

const kStatus = {
  'ok': 0,
  'budget-exhausted': 1
};

function penetrationBits(p) {
  return [
    kStatus[p.status],
    ...hexes([p.volume, p.volumeMin, p.volumeMax, ...p.centroid]),
    ...negated(p.force),
    ...negated(p.torque),
    p.nodeVisits,
    p.spherePairs,
  ];
}

/** By name: what is asked of a row, and its answer as bits. `ist`: a build of the package. */
export function queries(ist, a, b) {
  const halfSpace = ist.Field.halfSpace([0, 0.6, 0.8], 0.0625);
  const box = ist.Field.box([0.25, 0.5, 0.125]);
  const capsule = ist.Field.capsule(0.25, 0.375);
  const penetrationOf = (solid, options = {}) => {
    const reused = {...options, into: undefined};
    return {
      ask: (pose) => reused.into = ist.penetration(solid, b, pose, reused),
      bits: penetrationBits,
    };
  };
  const forSeparation = {into: undefined}, forPatches = {maxPatches: 16, into: undefined};
  return {
    'matched': penetrationOf(a),
    'lenses alone': penetrationOf(a, {field: 'never'}),
    'surface alone': penetrationOf(a, {field: 'always'}),
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
      bits: (found) => penetrationBits(found.whole)
                           .concat(...found.patches.slice(0, found.count)
                                       .map(
                                           (p) =>
                                               [p.id,
                                                ...hexes(p.centroid),
                                                ...hexes(p.normal),
                                                ...hexes([p.area, p.depth, p.volume]),
                                                ...hexes(p.force),
                                                ...hexes(p.torque),
  ])),
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
  };
}

/** All answers as native_rows prints them. */
export function rowsText(ist, bytesA, bytesB, csv) {
  const a = ist.Asset.from(bytesA, 'A'), b = ist.Asset.from(bytesB, 'B');
  const asked = Object.entries(queries(ist, a, b));
  const lines = parseRows(csv).flatMap(
      (pose, i) =>
          asked.map(([name, {ask, bits}]) => `${i} ${name}: ${bits(ask(pose)).join(' ')}\n`));
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
