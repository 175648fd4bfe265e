// Reads GLB files as others do, with glTF-Transform and Babylon.js:   npm ci; node read.mjs FILE_OR_FOLDER...
// Both must find the vertices and triangles that the document tells of, and the same bounds; indices must stay inside
// their vertices, and triangles of one-sided materials face their normals, which no validator asks for.
// Vertices that several primitives share count for each. Prints a line a file, then "N files, F failed". Exit: 0 all good, 1 a file failed, 2 no file found.

import { readFileSync } from "node:fs";

import { NullEngine } from "@babylonjs/core/Engines/nullEngine.js";
import { LoadAssetContainerAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { MeshoptCompression } from "@babylonjs/core/Meshes/Compression/meshoptCompression.js";
import { Logger } from "@babylonjs/core/Misc/logger.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/core/Materials/PBR/pbrMaterial.js";
import "@babylonjs/loaders/glTF/2.0/index.js";
import { Accessor } from "@gltf-transform/core";
import { MeshoptDecoder } from "meshoptimizer";

import { glbFiles, io } from "./glb-files.mjs";

const LEAST_SHARE_FACING = 0.99; // of one-sided triangles: where tubes bend sharply a few turn over
const BOUNDS_TOLERANCE = 1e-4; // of the largest extent: the steps of quantized positions lie on either side

// Babylon.js would fetch its decoder from the network; this one is the same library.
MeshoptCompression._Default = {
  decodeGltfBufferAsync: (source, count, stride, mode, filter) =>
    MeshoptDecoder.decodeGltfBufferAsync(count, stride, source, mode, filter),
};
Logger.LogLevels = Logger.ErrorLogLevel;

function require(condition, message) {
  if (!condition) throw new Error(message);
}

function emptyCounts() {
  return { vertices: 0, triangles: 0, low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity] };
}

function grow(counts, point) {
  for (let axis = 0; axis < 3; ++axis) {
    counts.low[axis] = Math.min(counts.low[axis], point[axis]);
    counts.high[axis] = Math.max(counts.high[axis], point[axis]);
  }
}

/** What the document says of the meshes below its scene, and of all: other levels of detail hang outside of it. */
function fromDocument(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const document = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + view.getUint32(12, true))));
  const count = (meshes) => {
    const counts = emptyCounts();
    for (const mesh of meshes)
      for (const primitive of document.meshes[mesh].primitives) {
        counts.vertices += document.accessors[primitive.attributes.POSITION].count;
        counts.triangles += document.accessors[primitive.indices].count / 3;
      }
    return counts;
  };
  const shown = [];
  const open = [...document.scenes[document.scene ?? 0].nodes];
  while (open.length > 0) {
    const node = document.nodes[open.pop()];
    if (node.mesh !== undefined) shown.push(node.mesh);
    open.push(...(node.children ?? []));
  }
  return { shown: count(shown), all: count(document.meshes.keys()) };
}

/** Coordinates of all elements of an accessor, one after the other, as floats whatever it is made of. */
function coordinates(accessor) {
  if (accessor.getComponentType() === Accessor.ComponentType.FLOAT) return accessor.getArray();
  const found = new Float32Array(accessor.getCount() * 3);
  const element = [];
  for (let i = 0; i < accessor.getCount(); ++i) found.set(accessor.getElement(i, element), 3 * i);
  return found;
}

/** Shares of triangles that face the normals of their corners. */
function facing(primitive) {
  const positions = coordinates(primitive.getAttribute("POSITION"));
  const normals = coordinates(primitive.getAttribute("NORMAL"));
  const indices = primitive.getIndices().getArray();
  let facing = 0;
  for (let i = 0; i < indices.length; i += 3) {
    const [a, b, c] = [3 * indices[i], 3 * indices[i + 1], 3 * indices[i + 2]];
    let along = 0;
    for (let axis = 0; axis < 3; ++axis) {
      const [second, third] = [(axis + 1) % 3, (axis + 2) % 3];
      const across =
        (positions[b + second] - positions[a + second]) * (positions[c + third] - positions[a + third]) -
        (positions[b + third] - positions[a + third]) * (positions[c + second] - positions[a + second]);
      along += across * (normals[a + axis] + normals[b + axis] + normals[c + axis]);
    }
    if (along >= 0) ++facing;
  }
  return facing / (indices.length / 3);
}

async function fromGltfTransform(bytes) {
  const document = await io.readBinary(bytes);
  const root = document.getRoot();
  const all = emptyCounts();
  for (const mesh of root.listMeshes())
    for (const primitive of mesh.listPrimitives()) {
      const vertices = primitive.getAttribute("POSITION").getCount();
      const indices = primitive.getIndices().getArray();
      all.vertices += vertices;
      all.triangles += indices.length / 3;
      const highest = indices.reduce((high, index) => Math.max(high, index), 0);
      require(highest < vertices, `an index is ${highest} of ${vertices} vertices`);
      if (!primitive.getMaterial().getDoubleSided()) {
        const share = facing(primitive);
        require(share >= LEAST_SHARE_FACING, `only ${(100 * share).toFixed(2)} % of triangles face their normals`);
      }
    }
  const shown = emptyCounts();
  root.getDefaultScene().traverse((node) => {
    const matrix = node.getSkin() ? node.getSkin().getInverseBindMatrices().getElement(0, []) : node.getWorldMatrix();
    const joint = node.getSkin()?.listJoints()[0].getWorldTranslation() ?? [0, 0, 0];
    const placed = [];
    for (const primitive of node.getMesh()?.listPrimitives() ?? []) {
      const positions = coordinates(primitive.getAttribute("POSITION"));
      const used = new Uint8Array(positions.length / 3);
      for (const index of primitive.getIndices().getArray()) used[index] = 1;
      for (let vertex = 0; vertex < used.length; ++vertex) {
        if (!used[vertex]) continue;
        for (let axis = 0; axis < 3; ++axis)
          placed[axis] =
            matrix[axis] * positions[3 * vertex] +
            matrix[4 + axis] * positions[3 * vertex + 1] +
            matrix[8 + axis] * positions[3 * vertex + 2] +
            matrix[12 + axis] +
            joint[axis];
        grow(shown, placed);
      }
    }
  });
  return { all, shown };
}

async function fromBabylon(bytes) {
  const engine = new NullEngine();
  const scene = new Scene(engine);
  scene.useRightHandedSystem = true;
  const container = await LoadAssetContainerAsync(bytes, scene, { pluginExtension: ".glb" });
  const counts = emptyCounts();
  for (const mesh of container.meshes) {
    if (mesh.getTotalVertices() === 0) continue;
    counts.vertices += mesh.getTotalVertices();
    counts.triangles += mesh.getTotalIndices() / 3;
    mesh.computeWorldMatrix(true);
    mesh.refreshBoundingInfo({ applySkeleton: mesh.skeleton != null });
    const box = mesh.getBoundingInfo().boundingBox;
    grow(counts, box.minimumWorld.asArray());
    grow(counts, box.maximumWorld.asArray());
  }
  scene.dispose();
  engine.dispose();
  return counts;
}

function requireSameCounts(who, found, expected) {
  for (const what of ["vertices", "triangles"])
    require(found[what] === expected[what], `${who} finds ${found[what]} ${what} of ${expected[what]}`);
}

function requireSameBounds(a, b) {
  const extent = Math.max(...[0, 1, 2].map((axis) => a.high[axis] - a.low[axis]));
  for (const side of ["low", "high"])
    for (let axis = 0; axis < 3; ++axis)
      require(
        Math.abs(a[side][axis] - b[side][axis]) <= BOUNDS_TOLERANCE * extent,
        `the bounds differ: ${a[side]} and ${b[side]}`,
      );
}

async function read(file) {
  const bytes = new Uint8Array(readFileSync(file));
  const expected = fromDocument(bytes);
  const transform = await fromGltfTransform(bytes);
  requireSameCounts("glTF-Transform", transform.all, expected.all);
  const babylon = await fromBabylon(bytes);
  requireSameCounts("Babylon.js", babylon, expected.shown);
  requireSameBounds(transform.shown, babylon);
  return expected.all;
}

await MeshoptDecoder.ready;
const files = process.argv.slice(2).flatMap(glbFiles);
let failed = 0;
for (const file of files) {
  try {
    const counts = await read(file);
    console.log(`${file}: ${counts.vertices} vertices, ${counts.triangles} triangles`);
  } catch (error) {
    ++failed;
    console.log(`${file}: FAILED: ${error.message}`);
  }
}
console.log(`${files.length} files, ${failed} failed`);
process.exit(files.length === 0 ? 2 : failed > 0 ? 1 : 0);
