// Checks GLB files with the Khronos glTF validator:   node validate.mjs FILE_OR_FOLDER...
// Folders are searched for *.glb. Prints every error and warning, then "N files, E errors, W warnings".
// Exit: 0 all clean, 1 an error or warning, 2 no file found. `--infos` prints the hints too.
//
// Files are checked in a child process, because a deeply nested scene kills the validator: that must count as an error
// of that file and not end the check. The next child goes on with the file after it.

import { spawnSync } from "node:child_process";
import { readdirSync, readFileSync, statSync, writeSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

const SEVERITIES = ["error", "warning", "info", "hint"];
const TIMEOUT_MS = 120_000; // a file
const FILES_A_CHILD = 20; // the start of a child takes as long as a file of 10 MB

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

/** The issues of the first of the files at least, and of as many more as a child gets through. */
function checkInChild(files) {
  const child = spawnSync(process.execPath, [fileURLToPath(import.meta.url), "--child", ...files], {
    encoding: "utf8",
    maxBuffer: 1 << 30,
    timeout: TIMEOUT_MS * files.length,
  });
  const checked = child.stdout.split("\n").slice(0, -1).map((line) => JSON.parse(line));
  if (checked.length === files.length) return checked;
  const fault = child.stderr.split("\n").find((line) => /^(\w*Error|Invalid data)\b/.test(line));
  const reason = child.error?.message ?? fault ?? `exit ${child.status}`;
  checked.push({ numErrors: 1, numWarnings: 0, messages: [{ severity: 0, code: "VALIDATOR_DIED", message: reason }] });
  return checked;
}

async function runChild(files) {
  const validator = createRequire(import.meta.url)("gltf-validator");
  for (const file of files) {
    const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), { uri: file, maxIssues: 1000 });
    writeSync(1, `${JSON.stringify(report.issues)}\n`);
  }
}

function runAll(paths, showInfos) {
  const files = paths.flatMap(glbFiles);
  let errors = 0;
  let warnings = 0;
  const checked = [];
  while (checked.length < files.length) {
    const open = files.slice(checked.length, checked.length + FILES_A_CHILD);
    checked.push(...checkInChild(open));
  }
  for (const [at, file] of files.entries()) {
    const issues = checked[at];
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
  await runChild(rest);
} else {
  const paths = process.argv.slice(2).filter((argument) => argument !== "--infos");
  process.exitCode = runAll(paths, paths.length < process.argv.length - 2);
}
