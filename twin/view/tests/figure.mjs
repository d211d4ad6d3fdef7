// The feet that the pages draw, against closed forms: `nodejs twin/view/tests/figure.mjs`.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

const script = readFileSync(new URL("../script/figure.js", import.meta.url), "utf8");
// Names of other scripts of the page that the pose needs.
const numbers = (column) => column;
const indexAt = (times, t) => times.findLastIndex((time) => time <= t);
const pose = new Function("numbers", "indexAt", `${script}; return pose;`)(numbers, indexAt);

const [length, angle, aside] = [0.2, 0.4, 0.3];
const axis = [0.1, 0.03, 0.01];
const hip = [0.1, 0.05, 0];
const half = [Math.sin(Math.PI / 4), Math.cos(Math.PI / 4)];

// The foot of a straight leg that is ahead by `angle`, of a trunk at (1, 2, 3) that faces left.
function foot(abduction) {
  const columns = (values) => values.map((value) => [value, value]);
  const figure = {
    times: [0, 1],
    trunk: columns([1, 2, 3, 0, 0, half[0], half[1]]),
    legs: [
      {
        name: "LF",
        offsets: [hip, [0, 0, -length], [0, 0, -length], [0, 0, -length]],
        angles: columns([angle, 0, 0]),
        abduction: abduction && { axis, angle: [abduction, abduction] },
      },
    ],
  };
  return pose(figure, 0.5).legs[0].points[3];
}

function inWorld([ahead, left, up]) {
  return [1 - left, 2 + ahead, 3 + up];
}

function close(found, expected) {
  found.forEach((value, i) => assert(Math.abs(value - expected[i]) < 1e-12, `${found} ${expected}`));
}

const ahead = hip[0] + 3 * length * Math.sin(angle);
const down = 3 * length * Math.cos(angle);
close(foot(null), inWorld([ahead, hip[1], -down]));
const [side, below] = [hip[1] - axis[1], down + axis[2] - hip[2]];
close(
  foot(aside),
  inWorld([
    ahead,
    axis[1] + side * Math.cos(aside) + below * Math.sin(aside),
    axis[2] + side * Math.sin(aside) - below * Math.cos(aside),
  ]),
);
console.log("figure: feet of legs that abduct");
