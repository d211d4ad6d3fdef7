// The robot: side, top and perspective view on a canvas. Kinematics of drawn lines only.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];

// Rotates a vector by a unit quaternion x, y, z, w.
function rotated([x, y, z, w], [a, b, c]) {
  const [u, v, n] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * u + y * n - z * v, b + w * v + z * u - x * n, c + w * n + x * v - y * u];
}

// Rotates a point of the trunk about an axis along it, to the left.
function abducted([, y, z], angle, point) {
  const [sin, cos] = [Math.sin(angle), Math.cos(angle)];
  const [a, b, c] = [point[0], point[1] - y, point[2] - z];
  return [a, y + b * cos - c * sin, z + b * sin + c * cos];
}

// Returns the numbers of columns at time `t`, linear between two frames.
function between(times, columns, t) {
  const i = indexAt(times, t);
  const j = Math.min(i + 1, times.length - 1);
  const share = j === i ? 0 : Math.min(Math.max((t - times[i]) / (times[j] - times[i]), 0), 1);
  return columns.map((column) => {
    const values = numbers(column);
    return values[i] + share * (values[j] - values[i]);
  });
}

// Returns trunk, legs and forces at time `t` in the world.
function pose(figure, t) {
  const times = numbers(figure.times);
  const [x, y, z, ...turn] = between(times, figure.trunk, t);
  const size = Math.hypot(...turn) || 1;
  const quaternion = turn.map((part) => part / size);
  const inWorld = (point) => add([x, y, z], rotated(quaternion, point));
  const legs = figure.legs.map((leg) => {
    const angles = between(times, leg.angles, t);
    const points = [leg.offsets[0]];
    let angle = 0;
    for (let joint = 0; joint < 3; joint += 1) {
      angle += angles[joint];
      const [, side, down] = leg.offsets[joint + 1];
      const [sin, cos] = [Math.sin(angle), Math.cos(angle)];
      points.push(add(points[joint], [-down * sin, side, down * cos]));
    }
    const { abduction } = leg;
    const aside = abduction ? between(times, [abduction.angle], t)[0] : 0;
    const inTrunk = abduction ? (point) => abducted(abduction.axis, aside, point) : (point) => point;
    return {
      name: leg.name,
      points: points.map(inTrunk).map(inWorld),
      force: leg.force && between(times, leg.force, t),
      push: leg.push && between(times, leg.push, t),
      segments: leg.segments && between(times, leg.segments, t),
    };
  });
  const push = figure.push && between(times, figure.push, t);
  const contact = figure.contact && between(times, figure.contact, t);
  return { at: [x, y, z], quaternion, inWorld, legs, push, contact };
}

// Views: horizontal and vertical coordinate of a point relative to the trunk, and whether z is up.
const VIEWS = {
  side: (point) => [point[0], point[2]],
  top: (point) => [point[0], point[1]],
  perspective: (point) => {
    const [yaw, pitch, far] = [0.7, 0.38, 1.6];
    const [a, b, c] = point;
    const across = a * Math.cos(yaw) - b * Math.sin(yaw);
    const away = a * Math.sin(yaw) + b * Math.cos(yaw);
    const depth = far + away * Math.cos(pitch) - c * Math.sin(pitch);
    const up = away * Math.sin(pitch) + c * Math.cos(pitch);
    return [(across * far) / depth, (up * far) / depth];
  },
};

const CAPTIONS = {
  side: "from the right; left legs are dashed",
  top: "from above, forward to the right",
  perspective: "lines on the ground every 0.1 m; arrows: forces on the feet",
};

// Colour of a leg by its index; names, dashes and positions tell them apart as well.
const legColour = (index) => colour(`--c${index % 8}`);

class Figure {
  constructor(run, index, view) {
    this.run = run;
    this.index = index;
    this.view = view;
    this.canvas = make("canvas", { class: "figure", "data-view": view });
    const pushed = run.figure.push || run.figure.legs.some((leg) => leg.push);
    this.element = make(
      "figure",
      { class: "robot" },
      make("figcaption", {}, `${data.runs.length > 1 ? `${"AB"[index]}: ` : ""}${CAPTIONS[view]}${view === "perspective" && pushed ? ", pushes in red" : ""}`),
      this.canvas,
    );
    const figure = run.figure;
    // Scale: the robot with its legs stretched forward.
    const reach = Math.max(
      ...figure.legs.map((leg) => {
        const length = leg.offsets.slice(1).reduce((sum, part) => sum + Math.hypot(...part), 0);
        return Math.hypot(leg.offsets[0][0], leg.offsets[0][1]) + length;
      }),
    );
    this.reach = reach;
    this.legs = figure.legs.map((leg) => leg.name);
  }

  draw(t) {
    const { run, reach } = this;
    const shown = fitted(this.canvas);
    if (!shown) return;
    const { context, width, height } = shown;
    const time = aligned(this.index, t);
    const now = pose(run.figure, time);
    const centre = [now.at[0], now.at[1], 0];
    const project = VIEWS[this.view];
    const scale = Math.min(width / (2.1 * reach), height / (1.3 * reach));
    const middle = this.view === "top" ? height / 2 : height - (this.view === "perspective" ? 0.36 : 0.2) * reach * scale;
    const place = (point) => {
      const [u, v] = project(add(point, [-centre[0], -centre[1], 0]));
      return [width / 2 + u * scale, middle - v * scale];
    };
    const line = (points, style, thickness, dash = []) => {
      context.beginPath();
      points.map(place).forEach(([u, v], i) => (i ? context.lineTo(u, v) : context.moveTo(u, v)));
      context.strokeStyle = style;
      context.lineWidth = thickness;
      context.setLineDash(dash);
      context.lineJoin = context.lineCap = "round";
      context.stroke();
    };
    this.#ground(context, line, centre);
    this.#trails(line, time);
    this.#trunk(context, place, line, now);
    // Far legs first.
    const order = now.legs.map((leg, i) => [leg, i]).sort((a, b) => b[0].points[0][1] - a[0].points[0][1]);
    for (const [leg, i] of order) this.#leg(context, place, line, leg, i);
    const force = this.run.figure.weight ?? 20;
    const arrow = (from, vector, style) => {
      const length = Math.hypot(...vector);
      if (length < 0.01 * force) return;
      const to = add(from, vector.map((axis) => (axis / force) * 0.55 * reach));
      line([from, to], style, 2.2);
      const [a, b] = [place(from), place(to)];
      const angle = Math.atan2(b[1] - a[1], b[0] - a[0]);
      if (Math.hypot(b[0] - a[0], b[1] - a[1]) < 3) return;
      context.beginPath();
      context.moveTo(...b);
      for (const side of [0.45, -0.45]) {
        context.lineTo(b[0] - 8 * Math.cos(angle + side), b[1] - 8 * Math.sin(angle + side));
      }
      context.closePath();
      context.fillStyle = style;
      context.fill();
    };
    for (const leg of now.legs) {
      if (leg.force) arrow(leg.points[3], leg.force, colour("--ink"));
      if (leg.segments) arrow(leg.points[2], leg.segments, colour("--ink"));
      if (leg.push) arrow(leg.points[3], leg.push, colour("--bad"));
    }
    if (now.contact) arrow(now.at, now.contact, colour("--ink"));
    if (now.push) arrow(now.at, now.push, colour("--bad"));
  }

  // Ground along the path, with a mark every 0.1 m that shows the motion.
  #ground(context, line, centre) {
    const { ground } = this.run.figure;
    if (!ground || this.view === "top") {
      if (this.view === "top") this.#marks(line, centre, () => 0, true);
      return;
    }
    const [xs, zs] = [numbers(ground.x), numbers(ground.z)];
    const near = xs.map((x, i) => [x, ground.y, zs[i]]).filter(([x]) => Math.abs(x - centre[0]) < 2 * this.reach);
    const wide = this.view === "perspective";
    const sides = wide ? [-0.8 * this.reach, 0.8 * this.reach] : [0];
    for (const side of sides) {
      line(near.map(([x, , z]) => [x, centre[1] + side, z]), colour("--soft"), wide ? 1 : 1.6);
    }
    this.#marks(line, centre, (x) => zs[indexAt(xs, x)], wide);
  }

  #marks(line, centre, height, wide) {
    const step = 0.1;
    const from = Math.ceil((centre[0] - 1.4 * this.reach) / step);
    for (let i = from; i * step < centre[0] + 1.4 * this.reach; i += 1) {
      const z = height(i * step);
      const side = wide ? 0.8 * this.reach : 0;
      const low = wide ? 0 : 0.02;
      const style = i % 10 === 0 ? colour("--soft") : colour("--faint");
      line([[i * step, centre[1] - side, z - low], [i * step, centre[1] + side, z]], style, 1);
    }
  }

  // Paths of the feet over the last half second.
  #trails(line, time) {
    const times = numbers(this.run.figure.times);
    const [first, last] = [indexAt(times, time - 0.5), indexAt(times, time)];
    const step = Math.max(1, Math.floor((last - first) / 50));
    const feet = this.legs.map(() => []);
    for (let i = first; i <= last; i += step) {
      pose(this.run.figure, times[i]).legs.forEach((leg, n) => feet[n].push(leg.points[3]));
    }
    feet.forEach((path, n) => line(path, `color-mix(in srgb, ${legColour(n)} 35%, transparent)`, 1.5));
  }

  #trunk(context, place, line, now) {
    const hips = this.run.figure.legs.map((leg) => leg.offsets[0]);
    const span = (axis) => [Math.min(...hips.map((hip) => hip[axis])), Math.max(...hips.map((hip) => hip[axis]))];
    const [[back, front], [right, left]] = [span(0), span(1)];
    const [low, high] = [-0.012, 0.028];
    const corner = (x, y, z) => now.inWorld([x, y, z]);
    const faces = [low, high].map((z) => [
      corner(back, right, z),
      corner(front, right, z),
      corner(front, left, z),
      corner(back, left, z),
    ]);
    context.beginPath();
    const side = [corner(back, right, low), corner(front, right, low), corner(front, right, high), corner(back, right, high)];
    (this.view === "top" ? faces[1] : side).map(place).forEach(([u, v], i) => (i ? context.lineTo(u, v) : context.moveTo(u, v)));
    context.closePath();
    context.fillStyle = colour("--fine");
    context.fill();
    for (const face of faces) line([...face, face[0]], colour("--soft"), 1.4);
    faces[0].forEach((from, i) => line([from, faces[1][i]], colour("--soft"), 1.4));
    // The nose points forward.
    line([corner(front, 0, high), corner(front + 0.035, 0, (low + high) / 2), corner(front, 0, low)], colour("--soft"), 1.4);
  }

  #leg(context, place, line, leg, i) {
    // Left legs are behind the others, but from above.
    const isFar = this.view !== "top" && this.run.figure.legs[i].offsets[0][1] > 0;
    line(leg.points, legColour(i), isFar ? 2.4 : 4.2, isFar ? [7, 4] : []);
    for (const point of leg.points) {
      const [u, v] = place(point);
      context.beginPath();
      context.arc(u, v, isFar ? 2.4 : 3.4, 0, 2 * Math.PI);
      context.fillStyle = colour("--card");
      context.fill();
      context.strokeStyle = legColour(i);
      context.lineWidth = 1.4;
      context.setLineDash([]);
      context.stroke();
    }
    const [u, v] = place(leg.points[3]);
    context.fillStyle = legColour(i);
    context.font = "600 11px system-ui, sans-serif";
    context.textAlign = "center";
    context.fillText(leg.name, u, v + (isFar ? 25 : 14));
  }
}
