/**
 * One vertex for all that lie at the same place: the parts of a stored surface share theirs bit by
 * bit.
 */
export function welded(vertices, corners) {
  const n = vertices.length / 3;
  let slots = 16;
  while (slots < 2 * n) slots *= 2;
  const table = new Int32Array(slots).fill(-1);  // of kept vertices, by their hash
  const bits = new Uint32Array(vertices.buffer, vertices.byteOffset, 2 * vertices.length);
  const positions = new Float64Array(vertices.length);
  const now = new Uint32Array(n);
  let kept = 0;
  for (let i = 0; i < n; ++i) {
    let hash = 0;
    for (let k = 0; k < 6; ++k)
      hash = Math.imul(hash ^ bits[6 * i + k], 0x9e3779b1) ^ (hash >>> 15);
    let slot = (hash ^ (hash >>> 16)) & (slots - 1);
    const x = vertices[3 * i], y = vertices[3 * i + 1], z = vertices[3 * i + 2];
    for (;; slot = (slot + 1) & (slots - 1)) {
      const j = table[slot];
      if (j < 0) {
        table[slot] = kept;
        positions.set([x, y, z], 3 * kept);
        now[i] = kept++;
        break;
      }
      if (positions[3 * j] === x && positions[3 * j + 1] === y && positions[3 * j + 2] === z) {
        now[i] = j;
        break;
      }
    }
  }
  return {
    positions: positions.slice(0, 3 * kept),
    triangles: Uint32Array.from(corners, (v) => now[v])
  };
}
