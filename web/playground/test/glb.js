// The smallest animated .glb: a triangle that goes up.

export function triangleGlb() {
  const corners = [0, 0, 0, 1, 0, 0, 0, 1, 0], times = [0, 2], places = [0, 0, 0, 0, 3, 0];
  const binary = Buffer.from(Float32Array.from([...corners, ...times, ...places]).buffer);
  const view = (byteOffset, count) => ({buffer: 0, byteOffset, byteLength: 4 * count});
  const accessor = (bufferView, count, type, min, max) =>
      ({bufferView, componentType: 5126, count, type, min, max});
  const json = {
    asset: {version: '2.0'},
    scene: 0,
    scenes: [{nodes: [0]}],
    nodes: [{mesh: 0}],
    meshes: [{primitives: [{attributes: {POSITION: 0}}]}],
    animations: [{
      samplers: [{input: 1, output: 2, interpolation: 'LINEAR'}],
      channels: [{sampler: 0, target: {node: 0, path: 'translation'}}],
    }],
    buffers: [{byteLength: binary.length}],
    bufferViews: [view(0, 9), view(36, 2), view(44, 6)],
    accessors: [
      accessor(0, 3, 'VEC3', [0, 0, 0], [1, 1, 0]),
      accessor(1, 2, 'SCALAR', [0], [2]),
      accessor(2, 2, 'VEC3'),
    ],
  };
  let text = JSON.stringify(json);
  text = text.padEnd(Math.ceil(text.length / 4) * 4);
  const words = (...values) => Buffer.from(Uint32Array.from(values).buffer);
  return Buffer.concat([
    words(0x46546c67, 2, 12 + 8 + text.length + 8 + binary.length),
    words(text.length, 0x4e4f534a),
    Buffer.from(text),
    words(binary.length, 0x004e4942),
    binary,
  ]);
}
