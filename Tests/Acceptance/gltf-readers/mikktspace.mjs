// Tangents of GLB files beside those that MikkTSpace makes of the same positions, normals and texture coordinates:
//   npm ci; node mikktspace.mjs FILE_OR_FOLDER...
// Normal maps are read in the frame of the tangents, and baking tools and engines that make their own take
// MikkTSpace's. A line a file and material: the mean angle between both, and shares of the surface beyond some angles.
// Corners count by the area of their triangle; those of triangles without area, on the surface or in the texture, have
// no tangent in MikkTSpace and are left out. A file fails where a single bitangent is on the other side, or where a
// mean is too large. Then "N files, F failed". Exit: 0 all good, 1 a file failed, 2 no file found.
//
// What remains between both is meant: MikkTSpace sees a surface end where its texture does, so that beside a seam its
// tangents are those of one facet, and takes facets as they lie, where ours follow the round limb. Of few sides, or
// where a branch stands on another and both share their normals, that is many degrees.

import { createRequire } from "node:module";
import { readFileSync } from "node:fs";

import { MeshoptDecoder } from "meshoptimizer";

import { glbFiles, io } from "./glb-files.mjs";

const { generateTangents } = createRequire(import.meta.url)("mikktspace"); // its module form is for bundlers

const BOUNDS = [5, 10, 30]; // degrees
const MOST_OF_WOOD = 15; // degrees, the mean: three-sided twigs of coarse levels, welded, come to 11
const MOST_OF_LEAVES = 3; // likewise: folded ones whose normals are bent come to 0.7, in bytes to 0.9
const NO_AREA = 1e-12; // of textures

/** An attribute's numbers, corner by corner of the triangles. */
function corners(primitive, name) {
  const attribute = primitive.getAttribute(name);
  const size = attribute.getElementSize();
  const indices = primitive.getIndices().getArray();
  const all = new Float32Array(indices.length * size);
  const element = [];
  indices.forEach((index, corner) => {
    attribute.getElement(index, element);
    all.set(element, corner * size);
  });
  return all;
}

function difference(all, size, to, from) {
  return Array.from({ length: size }, (_, axis) => all[to * size + axis] - all[from * size + axis]);
}

/** Twice the area of the triangle at `corner`; 0 if it has none in the texture. */
function areaOf(positions, uvs, corner) {
  const [a, b] = [1, 2].map((next) => difference(uvs, 2, corner + next, corner));
  const inTexture = a[0] * b[1] - a[1] * b[0];
  if (!(Math.abs(inTexture) > NO_AREA)) return 0;
  const [u, v] = [1, 2].map((next) => difference(positions, 3, corner + next, corner));
  return Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
}

function compare(primitive, counts) {
  const positions = corners(primitive, "POSITION");
  const normals = corners(primitive, "NORMAL");
  const uvs = corners(primitive, "TEXCOORD_0");
  const own = corners(primitive, "TANGENT");
  const theirs = generateTangents(positions, normals, uvs);
  for (let corner = 0; corner < positions.length / 3; ++corner) {
    const area = areaOf(positions, uvs, corner - (corner % 3));
    const [a, b] = [own, theirs].map((all) => all.subarray(4 * corner, 4 * corner + 4));
    const [lengthA, lengthB] = [a, b].map((t) => Math.hypot(t[0], t[1], t[2]));
    if (area === 0 || !(lengthB > 0)) continue;
    // Its bitangent points down the image, along v; that of glTF up.
    if (Math.sign(a[3]) !== -Math.sign(b[3])) ++counts.flipped;
    const cosine = (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) / (lengthA * lengthB);
    const degrees = (Math.acos(Math.min(Math.max(cosine, -1), 1)) * 180) / Math.PI;
    counts.area += area;
    counts.degrees += degrees * area;
    BOUNDS.forEach((bound, k) => (counts.beyond[k] += degrees > bound ? area : 0));
  }
}

async function read(file) {
  const document = await io.readBinary(new Uint8Array(readFileSync(file)));
  const materials = new Map();
  for (const mesh of document.getRoot().listMeshes())
    for (const primitive of mesh.listPrimitives()) {
      const material = primitive.getMaterial();
      if (!materials.has(material))
        materials.set(material, { area: 0, degrees: 0, flipped: 0, beyond: BOUNDS.map(() => 0) });
      compare(primitive, materials.get(material));
    }
  return materials;
}

/** Prints a line, and says whether it is a good one. */
function judge(file, material, counts) {
  const mean = counts.degrees / counts.area;
  const shares = BOUNDS.map((bound, k) => `${((100 * counts.beyond[k]) / counts.area).toFixed(2)} % beyond ${bound}`);
  const faults = [];
  if (!(counts.area > 0)) faults.push("no triangle has a tangent");
  if (counts.flipped > 0) faults.push(`${counts.flipped} corners have their bitangent on the other side`);
  if (!(mean <= (material.getDoubleSided() ? MOST_OF_LEAVES : MOST_OF_WOOD))) faults.push("the mean is too large");
  const fault = faults.length > 0 ? `FAILED: ${faults.join(", ")}: ` : "";
  console.log(`${file}: ${material.getName()}: ${fault}mean ${mean.toFixed(2)} degrees, ${shares.join(", ")}`);
  return faults.length === 0;
}

await MeshoptDecoder.ready;
const files = process.argv.slice(2).flatMap(glbFiles);
let failed = 0;
for (const file of files) {
  try {
    let isGood = true;
    for (const [material, counts] of await read(file)) isGood = judge(file, material, counts) && isGood;
    if (!isGood) ++failed;
  } catch (error) {
    ++failed;
    console.log(`${file}: FAILED: ${error.message}`);
  }
}
console.log(`${files.length} files, ${failed} failed`);
process.exit(files.length === 0 ? 2 : failed > 0 ? 1 : 0);
