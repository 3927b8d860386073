// A closed surface as textures in which a shader finds out whether a point lies inside: it counts the
// triangles above the point, of those in the point's column of a grid.

import * as THREE from 'three';

const kWidth = 2048;      // [texels] of a row
const kMostColumns = 256;  // along an edge of the grid
/** Slanted, so that walls of machined parts do not stand along the columns. */
const kSlant = new THREE.Matrix4().makeRotationFromEuler(new THREE.Euler(0.43, 0.61, 0.29));

export class Columns {
  /** `corners`: x, y, z of three a triangle. `toGrid` then takes the solid's frame to columns. */
  constructor(corners) {
    const count = corners.length / 9, at = new THREE.Vector3();
    const box = new THREE.Box3(), slanted = kSlant;
    for (let i = 0; i < corners.length; i += 3) box.expandByPoint(at.fromArray(corners, i).applyMatrix4(slanted));
    const side = this.side = Math.max(1, Math.min(kMostColumns, Math.round(Math.sqrt(count) / 1.5)));
    const extent = Math.max(box.max.x - box.min.x, box.max.y - box.min.y);
    const scale = 0.999 * side / extent;
    this.toGrid = new THREE.Matrix4()
                      .makeScale(scale, scale, scale)
                      .multiply(new THREE.Matrix4().makeTranslation(box.min.negate()))
                      .multiply(slanted);

    const inGrid = texels(Float32Array, 4, 3 * count);
    for (let i = 0; i < 3 * count; ++i) at.fromArray(corners, 3 * i).applyMatrix4(this.toGrid).toArray(inGrid, 4 * i);
    const eachColumn = (act) => {
      for (let t = 0; t < count; ++t) {
        const [ax, ay, , , bx, by, , , cx, cy] = inGrid.subarray(12 * t, 12 * t + 10);
        const right = Math.floor(Math.max(ax, bx, cx)), up = Math.floor(Math.max(ay, by, cy));
        for (let y = Math.floor(Math.min(ay, by, cy)); y <= up; ++y)
          for (let x = Math.floor(Math.min(ax, bx, cx)); x <= right; ++x) act(y * side + x, t);
      }
    };
    // The begin of each column's list, the end of the last, then the lists.
    const begins = new Uint32Array(side * side + 1);
    eachColumn((column) => ++begins[column]);
    let end = begins.length;
    for (let column = 0; column < begins.length; ++column) begins[column] = end += begins[column];
    const lists = texels(Uint32Array, 1, end);
    eachColumn((column, triangle) => lists[--begins[column]] = triangle);
    lists.set(begins);
    this.lists = texture(lists, 1, THREE.RedIntegerFormat, THREE.UnsignedIntType);
    this.lists.internalFormat = 'R32UI';
    this.corners = texture(inGrid, 4, THREE.RGBAFormat, THREE.FloatType);
  }

  dispose() {
    this.lists.dispose();
    this.corners.dispose();
  }
}

const texels = (Kind, each, count) => new Kind(each * kWidth * Math.ceil(count / kWidth));

function texture(data, each, format, type) {
  const made = new THREE.DataTexture(data, kWidth, data.length / each / kWidth, format, type);
  made.needsUpdate = true;
  return made;
}

/** GLSL: `isInside(point)`, the point in columns. An edge decides alike for both its triangles. */
export const kIsInside = /* glsl */ `
uniform highp usampler2D lists;
uniform highp sampler2D corners;
uniform int side;
int listed(int i) { return int(texelFetch(lists, ivec2(i % ${kWidth}, i / ${kWidth}), 0).r); }
vec3 corner(int i) { return texelFetch(corners, ivec2(i % ${kWidth}, i / ${kWidth}), 0).xyz; }
bool isRightOf(vec3 a, vec3 b, vec2 p) {
  if ((a.y > p.y) == (b.y > p.y)) return false;
  vec3 low = a.y < b.y ? a : b, high = a.y < b.y ? b : a;
  return p.x < low.x + (p.y - low.y) * (high.x - low.x) / (high.y - low.y);
}
bool isInside(vec3 p) {
  ivec2 at = ivec2(floor(p.xy));
  if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, ivec2(side)))) return false;
  int column = at.y * side + at.x, end = listed(column + 1);
  bool inside = false;
  for (int i = listed(column); i < end; ++i) {
    int t = 3 * listed(i);
    vec3 a = corner(t), b = corner(t + 1), c = corner(t + 2);
    if (isRightOf(a, b, p.xy) != isRightOf(b, c, p.xy) != isRightOf(c, a, p.xy)) {
      vec3 n = cross(b - a, c - a);
      float z = a.z - dot(n.xy, p.xy - a.xy) / n.z;
      if (clamp(z, min(a.z, min(b.z, c.z)), max(a.z, max(b.z, c.z))) > p.z) inside = !inside;
    }
  }
  return inside;
}
`;
