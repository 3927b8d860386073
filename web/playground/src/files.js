// A visitor's files, dropped or chosen: their contents, or a sentence that explains the failure.

import {Asset} from 'ist-query';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';

const kMost = 512 * 2 ** 20;  // bytes
/** Endings of meshes, which have to be baked. */
const kMeshes = ['obj', 'stl', 'ply', 'off', 'glb', 'gltf', 'dae'];

/**
 * Returns {kind: 'solid', asset} or {kind: 'scene', scene, animations}. Throws an Error whose message
 * is a sentence.
 */
export async function readFile(file) {
  const ending = file.name.toLowerCase().split('.').pop();
  const read = {ist: readSolid, glb: readScene}[ending];
  if (!read && kMeshes.includes(ending)) throw isMesh(file.name);
  if (!read) throw new Error(`${file.name}: the page opens solids (.ist) and scenes (.glb).`);
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

async function readScene(bytes, name) {
  const {scene, animations} = await new GLTFLoader().parseAsync(bytes, '');
  if (animations.length === 0) throw isMesh(name);
  return {kind: 'scene', name, scene, animations};
}

/** The page cannot bake. */
function isMesh(name) {
  const baked = name.replace(/\.[^.]+$/, '.ist');
  const [from, to] = [name, baked].map((word) => /\s/.test(word) ? `"${word}"` : word);
  return new Told(
      `${name} is a mesh. The page opens solids: run \`ist bake ${from} -o ${to}\`, then drop ` +
      `${baked}. The solids shown have not changed.`);
}

/** Calls `take(files)` for files dropped on the page; `hint` is visible while they are held over it. */
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
