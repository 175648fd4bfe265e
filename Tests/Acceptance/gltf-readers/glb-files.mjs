// What the readers here share: which files they are given, and how glTF-Transform reads them.

import { readdirSync, statSync } from "node:fs";
import { join } from "node:path";

import { NodeIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS } from "@gltf-transform/extensions";
import { MeshoptDecoder } from "meshoptimizer";

export const io = new NodeIO()
  .registerExtensions(ALL_EXTENSIONS)
  .registerDependencies({ "meshopt.decoder": MeshoptDecoder });
io.setLogger({ debug() {}, info() {}, warn() {}, error: console.error });

/** The files that a path names: itself, or what a folder holds, in order. */
export function glbFiles(path) {
  if (!statSync(path).isDirectory()) return [path];
  return readdirSync(path)
    .sort()
    .filter((name) => name.endsWith(".glb"))
    .map((name) => join(path, name));
}
