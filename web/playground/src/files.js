// A visitor's files, dropped or chosen: what they hold, or a sentence on why nothing.

import {Asset} from 'ist-query';
import * as THREE from 'three';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {OBJLoader} from 'three/addons/loaders/OBJLoader.js';
import {PLYLoader} from 'three/addons/loaders/PLYLoader.js';
import {STLLoader} from 'three/addons/loaders/STLLoader.js';
import {mergeGeometries} from 'three/addons/utils/BufferGeometryUtils.js';

const kMost = 512 * 2 ** 20;  // bytes

/**
 * What a file is: {kind: 'solid', asset}, {kind: 'looks', geometry} or
 * {kind: 'scene', scene, animations}. Throws an Error with a sentence.
 */
export async function readFile(file) {
  const ending = file.name.toLowerCase().split('.').pop();
  const read = {ist: readSolid, obj: readObj, stl: readStl, ply: readPly, glb: readGlb}[ending];
  if (!read) {
    throw new Error(
        `${file.name}: the page opens .ist, .obj, .stl, .ply and .glb files.` +
        (ending === 'gltf' ? ' Save it as .glb, in one file.' : ''));
  }
  if (file.size === 0) throw new Error(`${file.name} is empty.`);
  if (file.size > kMost)
    throw new Error(`${file.name} is larger than 512 MB, too much for a page.`);
  const bytes = await file.arrayBuffer();
  try {
    return await read(bytes, file.name);
  } catch (error) {
    if (error instanceof Told) throw error;
    throw new Error(`${file.name} cannot be read as ${ending.toUpperCase()}: ${reason(error)}.`);
  }
}

/** Already a whole sentence. */
class Told extends Error {}

const reason = (error) =>
    String(error?.message ?? error).replace(/^THREE\.\w+: /, '').replace(/\.$/, '');

function readSolid(bytes, name) {
  try {
    return {kind: 'solid', name, asset: Asset.from(bytes, name)};
  } catch (error) {
    throw new Told(`${error.message.replace(/^ist: /, '')}.`);
  }
}

const text = (bytes) => new TextDecoder().decode(bytes);

const readObj = (bytes, name) => looks(new OBJLoader().parse(text(bytes)), name);
const readStl = (bytes, name) => looks(new THREE.Mesh(new STLLoader().parse(bytes)), name);
const readPly = (bytes, name) => looks(new THREE.Mesh(new PLYLoader().parse(bytes)), name);

async function readGlb(bytes, name) {
  const {scene, animations} = await new GLTFLoader().parseAsync(bytes, '');
  if (animations.length > 0) return {kind: 'scene', name, scene, animations};
  return looks(scene, name);
}

/** All triangles of a model as one geometry. */
function looks(model, name) {
  const parts = [];
  model.updateMatrixWorld(true);
  model.traverse((part) => {
    if (!part.isMesh) return;
    let geometry = part.geometry.index ? part.geometry.toNonIndexed() : part.geometry.clone();
    const position = geometry.getAttribute('position');
    if (!position || position.count < 3) return;
    geometry = new THREE.BufferGeometry().setAttribute(
        'position',
        new THREE.BufferAttribute(
            Float32Array.from(
                {length: 3 * position.count},
                (_, i) => position.getComponent(Math.floor(i / 3), i % 3)),
            3));
    parts.push(geometry.applyMatrix4(part.matrixWorld));
  });
  if (parts.length === 0) throw new Told(`${name} holds no triangles.`);
  const geometry = mergeGeometries(parts);
  if (!geometry.getAttribute('position').array.every(Number.isFinite)) {
    throw new Told(`${name} has corners that are no finite numbers.`);
  }
  geometry.computeVertexNormals();
  return {kind: 'looks', name, geometry};
}

/** Calls `take(files)` for what is dropped on the page; `hint` shows while it is held over it. */
export function acceptDrops(hint, take) {
  let depth = 0;
  const holdsFiles = (event) => event.dataTransfer?.types.includes('Files');
  addEventListener('dragenter', (event) => {
    if (holdsFiles(event)) hint.hidden = ++depth === 0;
  });
  addEventListener('dragleave', (event) => {
    if (holdsFiles(event)) hint.hidden = --depth <= 0;
  });
  addEventListener('dragover', (event) => {
    if (holdsFiles(event)) event.preventDefault();
  });
  addEventListener('drop', (event) => {
    if (!holdsFiles(event)) return;
    event.preventDefault();
    depth = 0;
    hint.hidden = true;
    take([...event.dataTransfer.files]);
  });
}
