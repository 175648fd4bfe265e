// Checks GLB files with the Khronos glTF validator:   node validate.mjs FILE_OR_FOLDER...
// Folders are searched for *.glb. Prints every error and warning, then "N files, E errors, W warnings".
// Exit: 0 all clean, 1 an error or warning, 2 no file found. `--infos` prints the hints too.
//
// Each file is checked in a child process, because a deeply nested scene kills the validator: that must count as an
// error of that file and not end the check.

import { spawnSync } from "node:child_process";
import { readdirSync, readFileSync, statSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

const SEVERITIES = ["error", "warning", "info", "hint"];
const TIMEOUT_MS = 120_000;

function glbFiles(path) {
  if (!statSync(path).isDirectory()) return [path];
  return readdirSync(path, { withFileTypes: true })
    .sort((a, b) => (a.name < b.name ? -1 : 1))
    .flatMap((entry) => {
      const inside = join(path, entry.name);
      if (entry.isDirectory()) return glbFiles(inside);
      return entry.name.endsWith(".glb") ? [inside] : [];
    });
}

function checkInChild(file) {
  const child = spawnSync(process.execPath, [fileURLToPath(import.meta.url), "--child", file], {
    encoding: "utf8",
    maxBuffer: 64 << 20,
    timeout: TIMEOUT_MS,
  });
  if (child.status === 0) return JSON.parse(child.stdout);
  const reason = child.error?.message ?? (child.stderr.trim().split("\n").pop() || `exit ${child.status}`);
  return { numErrors: 1, numWarnings: 0, messages: [{ severity: 0, code: "VALIDATOR_DIED", message: reason }] };
}

async function runChild(file) {
  const validator = createRequire(import.meta.url)("gltf-validator");
  const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), { uri: file, maxIssues: 1000 });
  process.stdout.write(JSON.stringify(report.issues));
}

function runAll(paths, showInfos) {
  const files = paths.flatMap(glbFiles);
  let errors = 0;
  let warnings = 0;
  for (const file of files) {
    const issues = checkInChild(file);
    errors += issues.numErrors;
    warnings += issues.numWarnings;
    for (const issue of issues.messages) {
      if (issue.severity <= 1 || showInfos)
        console.log(`${file}: ${SEVERITIES[issue.severity]}: ${issue.code} ${issue.pointer ?? ""} ${issue.message}`);
    }
  }
  console.log(`${files.length} files, ${errors} errors, ${warnings} warnings`);
  return files.length === 0 ? 2 : errors + warnings > 0 ? 1 : 0;
}

const [first, ...rest] = process.argv.slice(2);
if (first === "--child") {
  await runChild(rest[0]);
} else {
  const paths = process.argv.slice(2).filter((argument) => argument !== "--infos");
  process.exitCode = runAll(paths, paths.length < process.argv.length - 2);
}
