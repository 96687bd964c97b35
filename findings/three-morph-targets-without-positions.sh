#!/usr/bin/env bash
# three.js 0.187.0 (npm), `GLTFLoader`: where is a vertex whose first morph target moves nothing but normals, and whose second moves
# places, when the first has the weight 1 and the second 0?
#
# One would guess where the mesh has it: what a target does not list it does not change (glTF 2.0, 3.7.2.2), and Khronos' validator
# finds nothing to complain of. Seen: twice as far from the origin. As soon as one target lists positions, each that lists none is
# given the mesh's own positions, and these are then taken for displacements. The same with a second target that lists no normals.
#
# Needs Node.js 18 or later and the network for npm. Exits with 0 while this is so, with 1 once it has changed.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
npm install --silent --no-audit --no-fund --prefix "$folder" three@0.187.0 gltf-validator@2.0.0-dev.3.10 >/dev/null
cat > "$folder/look.mjs" <<'NODE'
import { createRequire } from "node:module";
globalThis.self = globalThis;
globalThis.ProgressEvent ??= class extends Event {};
const require = createRequire(import.meta.url);
const { validateBytes } = require("gltf-validator");
const { GLTFLoader } = await import("three/examples/jsm/loaders/GLTFLoader.js");
const { REVISION, Vector3 } = await import("three");

// A triangle, its normals, and nine zeros for whatever a target lists.
const numbers = new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
const accessor = (byteOffset, extra = {}) =>
  ({ bufferView: 0, byteOffset, componentType: 5126, count: 3, type: "VEC3", ...extra });
const [POSITION, NORMAL, ZEROS] = [0, 1, 2];
const file = targets => JSON.stringify({
  asset: { version: "2.0" },
  scene: 0,
  scenes: [{ nodes: [0] }],
  nodes: [{ mesh: 0 }],
  meshes: [{ weights: [1, 0], primitives: [{ attributes: { POSITION, NORMAL }, targets }] }],
  accessors: [accessor(0, { min: [0, 0, 0], max: [1, 1, 0] }), accessor(36), accessor(72, { min: [0, 0, 0], max: [0, 0, 0] })],
  bufferViews: [{ buffer: 0, byteLength: numbers.byteLength, byteStride: 12, target: 34962 }],
  buffers: [{ byteLength: numbers.byteLength,
    uri: "data:application/octet-stream;base64," + Buffer.from(numbers.buffer).toString("base64") }],
});
const seen = async targets => {
  const text = file(targets);
  const { issues } = await validateBytes(new TextEncoder().encode(text));
  const { scene } = await new GLTFLoader().parseAsync(text, "");
  let mesh;
  scene.traverse(node => { mesh = node.isMesh ? node : mesh; });
  const x = mesh.getVertexPosition(1, new Vector3()).x;
  return { x, problems: issues.numErrors + issues.numWarnings };
};
const both = await seen([{ NORMAL: ZEROS, POSITION: ZEROS }, { POSITION: ZEROS }]);
const normalsAlone = await seen([{ NORMAL: ZEROS }, { POSITION: ZEROS }]);
console.log(`three.js ${REVISION}; all displacements are 0, the vertex is at x = 1`);
console.log(`the first target lists normals and positions: x = ${both.x}, problems of the file: ${both.problems}`);
console.log(`the first target lists normals alone:         x = ${normalsAlone.x}, problems of the file: ${normalsAlone.problems}`);
const still = both.x === 1 && normalsAlone.x === 2 && both.problems + normalsAlone.problems === 0;
console.log(still ? "seen: a target without positions moves each vertex by its own place" : "changed");
process.exit(still ? 0 : 1);
NODE
(cd "$folder" && node look.mjs)
