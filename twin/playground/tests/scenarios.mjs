// Runs the shipped scenarios in the module and by the program: all that the reports say of the runs
// must be equal, to the last digit of the fingerprints.
//
// Usage: nodejs scenarios.mjs MODULE PROGRAM

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync, readdirSync } from "node:fs";

const [modulePath, program] = process.argv.slice(2);
const here = (name) => new URL(name, import.meta.url);
const script = readFileSync(here("../page/module.js"), "utf8");
const answerOf = new Function(`${script}\nreturn answerOf;`)();
const module = new WebAssembly.Module(readFileSync(modulePath));

// Long runs are compared up to here.
const UNTIL = "20 s";

// They need a file beside them, or an engine.
const REFUSED = {
  "scenarios/thesis/fig-4-8.toml": "there is no bench `simulated`",
  "scenarios/models/pup.toml": "this build has no plant `mjcf`",
};

process.chdir(new URL("../../..", import.meta.url).pathname);

const folders = ["scenarios", "scenarios/thesis", "scenarios/models"];
const files = folders.flatMap((folder) =>
  readdirSync(folder)
    .filter((name) => name.endsWith(".toml"))
    .map((name) => `${folder}/${name}`),
);

async function inModule(file, text = readFileSync(file, "utf8")) {
  let last = 0;
  const progress = (share) => {
    // A reference run comes first, with a progress of its own.
    assert.ok(share >= 0 && share <= 1, `${file}: a progress of ${share}`);
    last = share;
  };
  const answer = await answerOf(module, { file, text, until: UNTIL, wanted: "report" }, progress);
  assert.ok(answer.error || last > 0, `${file}: there is no progress`);
  return answer;
}

function byProgram(file) {
  const words = ["run", file, "--until", UNTIL, "--json", "--no-record"];
  const { stdout } = spawnSync(program, words, { encoding: "utf8", maxBuffer: 2 ** 28 });
  return JSON.parse(stdout);
}

// What a report says of one run: all but times of the wall clock, and ensembles, which the program
// runs as well.
function facts(report) {
  const { wall_s, real_time_factor, expectations, ...rest } = report;
  return { ...rest, expectations: expectations.map(({ ensemble, ...outcome }) => outcome) };
}

let count = 0;
for (const file of files) {
  const { report, error } = await inModule(file);
  const refusal = REFUSED[file];
  if (refusal) {
    assert.ok(error?.includes(refusal), `${file}: ${error}`);
    continue;
  }
  assert.equal(error, null, file);
  assert.match(report.fingerprint, /^[0-9a-f]{64}$/);
  assert.deepEqual(facts(report), facts(byProgram(file)), file);
  count += 1;
}

// The comparison can fail.
const TROT = "scenarios/trot.toml";
const other = readFileSync(TROT, "utf8").replace('step = "2 ms"', 'step = "1 ms"');
const { report } = await inModule(TROT, other);
assert.notEqual(report.fingerprint, byProgram(TROT).fingerprint);

// A trap is an answer, and the next request has an instance of its own.
const trap = new WebAssembly.Module(
  // (module (import "host" "progress" (func (param f64))) (memory (export "memory") 1)
  //  (func (export "reserve") (param i32) (result i32) i32.const 0)
  //  (func (export "run") (result i32) unreachable))
  new Uint8Array([
    0, 97, 115, 109, 1, 0, 0, 0, 1, 14, 3, 96, 1, 124, 0, 96, 1, 127, 1, 127, 96, 0, 1, 127, 2, 17, 1, 4, 104, 111,
    115, 116, 8, 112, 114, 111, 103, 114, 101, 115, 115, 0, 0, 3, 3, 2, 1, 2, 5, 3, 1, 0, 1, 7, 26, 3, 6, 109, 101,
    109, 111, 114, 121, 2, 0, 7, 114, 101, 115, 101, 114, 118, 101, 0, 1, 3, 114, 117, 110, 0, 2, 10, 10, 2, 4, 0,
    65, 0, 11, 3, 0, 0, 11,
  ]),
);
const failed = await answerOf(trap, {}, () => {});
assert.match(failed.error, /The rig has failed: unreachable/);

// So is a module that cannot be instantiated.
const empty = new WebAssembly.Module(new Uint8Array([0, 97, 115, 109, 1, 0, 0, 0]));
assert.match((await answerOf(empty, {}, () => {})).error, /The rig has failed/);

console.log(`playground: ${count} scenarios have the bits of the program, ${Object.keys(REFUSED).length} are refused`);
