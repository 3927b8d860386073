// Valid names of options: others are misspelt.

const kLimits = ['maxVisits', 'poseA', 'into'];
const kContact = [...kLimits, 'measure', 'spheresOnly', 'relativeError', 'pairBudget', 'pairId'];
const kOfBatch = (names) => names.filter((name) => name !== 'poseA');
const kPenetration = kContact, kPatches = [...kContact, 'maxPatches'];

const kNames = {
  'init()': ['wasm'],
  'Asset.spheres()': ['measure', 'detail'],
  'Shape.distanceGrid()': ['origin', 'error'],
  'penetration()': kPenetration,
  'separation()': [...kLimits, 'innerSpheres', 'maxDistance', 'pairId'],
  'contactPatches()': kPatches,
  'overlap()': ['poseA'],
  'overlapOutline()': ['poseA', 'maxPatches', 'maxVisits', 'pairId', 'into'],
  'lenses()': ['poseA', 'measure', 'detailA', 'detailB', 'maxLenses', 'into'],
  'raycast()': ['maxDistance', 'into'],
  'closestPoint()': ['into'],
  'contains()': ['into'],
  'withoutProtrusion()': ['poseA', 'into'],
  'patchesWithoutProtrusion()': kPatches,
  'wrenches()': ['a', 'b'],
  'sizeMatch()': ['scaleA', 'scaleB'],
  'timeOfImpact()': [...kLimits, 'motionA', 'motionB', 'duration', 'tolerance'],
  'Scene()': ['maxBodies', 'maxPairs'],
  'Scene.add()': ['number', 'moves', 'group', 'layers', 'meets'],
  'Scene.setRule()': ['answer', 'margin', ...kContact.filter((name) => !['poseA', 'into', 'pairId'].includes(name))],
  'Scene.step()': ['into'],
  'Scene.raycast()': ['maxDistance', 'into'],
  'Scene.nearest()': ['maxDistance', 'into'],
  'penetrationBatch()': kOfBatch(kPenetration),
  'contactPatchesBatch()': kOfBatch(kPatches),
};

/** Throws a TypeError for an option that `who` does not have. */
export function checkOptions(who, options) {
  const names = kNames[who];
  for (const name in options)
    if (!names.includes(name))
      throw new TypeError(`ist: ${who}: no option is called ${name}; there are ${names.join(', ')}`);
}
