// Plots over time: the measured value of an expectation, and signals.

const DEGREES = 180 / Math.PI;
const inUnit = (unit) => (unit === "rad" ? { factor: DEGREES, unit: "°" } : { factor: 1, unit });
const scaled = (values, factor) =>
  factor === 1 ? values : values.map((value) => (value === null ? null : value * factor));

// Joins series with times of their own to rows over all times; gaps of one are bridged.
function joined(tables) {
  if (tables.length === 1) return tables[0];
  return uPlot.join(tables, tables.map((table) => table.slice(1).map(() => 2)));
}

const plots = new Set();

// Marks the instant of the slider and intervals of pushes and faults; a click moves the slider.
function timePlugin(bands) {
  const draw = (plot) => {
    const { ctx, bbox } = plot;
    const x = (t) => plot.valToPos(t, "x", true);
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const { from, to, style } of bands) {
      ctx.fillStyle = style;
      ctx.globalAlpha = 0.12;
      ctx.fillRect(x(from), bbox.top, Math.max(x(to) - x(from), 2), bbox.height);
    }
    ctx.globalAlpha = 1;
    ctx.fillStyle = colour("--ink");
    ctx.fillRect(x(clock.now) - 1, bbox.top, 2, bbox.height);
    ctx.restore();
  };
  const ready = (plot) => {
    let pressed = null;
    plot.over.addEventListener("pointerdown", (event) => (pressed = event.clientX));
    plot.over.addEventListener("pointerup", (event) => {
      if (pressed !== null && Math.abs(event.clientX - pressed) < 3) {
        const left = event.clientX - plot.over.getBoundingClientRect().left;
        clock.set(plot.posToVal(left, "x"));
      }
      pressed = null;
    });
  };
  return { hooks: { draw, ready } };
}

const bandsOf = () =>
  data.runs.flatMap((run, index) =>
    run.incidents
      .filter((it) => it.until !== undefined && ["push", "fault"].includes(it.kind))
      .map((it) => ({
        from: unaligned(index, it.at),
        to: unaligned(index, it.until),
        style: colour(KINDS[it.kind].colour),
      })),
  );

// Creates a plot of `series` [{label, scale, values, style, dash}] with bounds [{scale, value}].
function timePlot(host, { rows, series, bounds = [], scales, height = 260, shade = [] }) {
  const units = [...new Set(series.map((it) => it.unit))];
  const axis = {
    stroke: colour("--soft"),
    grid: { stroke: colour("--faint"), width: 1 },
    ticks: { stroke: colour("--faint"), width: 1 },
    font: "12px system-ui, sans-serif",
  };
  const limits = {
    hooks: {
      draw: (plot) => {
        for (const { unit, value } of bounds) {
          const y = plot.valToPos(value, unit, true);
          plot.ctx.save();
          plot.ctx.strokeStyle = colour("--bad");
          plot.ctx.setLineDash([7, 5]);
          plot.ctx.lineWidth = 1.5;
          plot.ctx.beginPath();
          plot.ctx.moveTo(plot.bbox.left, y);
          plot.ctx.lineTo(plot.bbox.left + plot.bbox.width, y);
          plot.ctx.stroke();
          plot.ctx.restore();
        }
      },
    },
  };
  const options = {
    width: Math.max(host.clientWidth, 240),
    height,
    cursor: { drag: { x: true, y: false }, sync: { key: "time", setSeries: false } },
    legend: { live: true },
    scales: {
      x: { time: false },
      ...Object.fromEntries(units.map((unit) => [unit, scales?.[unit] ?? {}])),
    },
    axes: [
      { ...axis, label: "time [s]", labelSize: 18, size: 34 },
      ...units.map((unit, i) => ({
        ...axis,
        scale: unit,
        side: i === 0 ? 3 : 1,
        label: unit === "1" || unit === "" ? " " : `[${unit}]`,
        labelSize: 18,
        size: 62,
        grid: { ...axis.grid, show: i === 0 },
      })),
    ],
    series: [
      { label: "time", value: (_, t) => (t === null ? "–" : `${t.toFixed(4)} s`) },
      ...series.map((it) => ({
        label: it.label,
        scale: it.unit,
        stroke: it.style,
        width: 1.6,
        dash: it.dash,
        spanGaps: it.spanGaps ?? false,
        points: { show: false },
        value: (_, value) => (value === null ? "–" : quantity(value, it.unit)),
      })),
    ],
    bands: shade.map(([a, b]) => ({ series: [a, b], fill: colour("--floor") })),
    plugins: [timePlugin(bandsOf()), limits],
  };
  const plot = new uPlot(options, rows, host);
  plots.add(plot);
  plot.host = host;
  return plot;
}

function discard(plot) {
  if (!plot) return;
  plots.delete(plot);
  plot.destroy();
}

new ResizeObserver(() => {
  for (const plot of plots) {
    const width = Math.max(plot.host.clientWidth, 240);
    if (width !== plot.width) plot.setSize({ width, height: plot.height });
  }
}).observe(document.body);

// The measured value of an expectation over time, and what is known of it.
class Course {
  constructor(host) {
    this.host = host;
    this.title = make("h3", { id: "course-title" });
    this.text = make("p", { class: "soft" });
    this.area = make("div", { class: "plot" });
    host.append(make("figure", {}, this.title, this.text, this.area));
  }

  show(number) {
    const chosen = data.runs.map((run) => run.judged.expectations[number]);
    const first = chosen[data.open[0]] ?? chosen[0];
    if (!first) return;
    discard(this.plot);
    this.plot = null;
    const { factor, unit } = inUnit(first.unit);
    const tables = data.runs.map((run, index) => {
      const expected = chosen[index];
      // A fall is measured as a height, or as an angle.
      if (!expected?.course || !run.judged.times || expected.unit !== first.unit) return null;
      const times = numbers(run.judged.times).map((t) => unaligned(index, t));
      return [times, scaled(numbers(expected.course), factor)];
    });
    this.title.textContent = first.name;
    const text = (expected, index) => {
      const mark = data.runs.length > 1 ? `${"AB"[index]}: ` : "";
      const at = expected.at === null ? "" : ` at ${expected.at.toFixed(4)} s`;
      const detail = expected.detail ? ` (${expected.detail})` : "";
      return `${mark}${expected.verdict}, measured ${quantity(expected.measured, expected.unit)}${at}${detail}.`;
    };
    this.text.textContent = chosen.map((it, index) => (it ? text(it, index) : "")).join(" ");
    const known = tables.map((table, index) => [table, index]).filter(([table]) => table);
    if (known.length === 0) {
      this.text.textContent += " Its value over time is known of repeated runs only.";
      return;
    }
    this.text.textContent +=
      " Plotted: the measured value if the scenario had ended at that instant; red: bounds.";
    const limits = [first.min, first.max].filter((it) => it !== null).map((it) => it * factor);
    this.plot = timePlot(this.area, {
      rows: joined(known.map(([table]) => table)),
      series: known.map(([, index]) => ({
        label: data.runs.length > 1 ? `${"AB"[index]} measured` : "measured",
        unit,
        style: colour(index ? "--c6" : "--c0"),
        spanGaps: false,
      })),
      bounds: limits.map((value) => ({ unit, value })),
      scales: {
        [unit]: {
          range: (_, low, high) => {
            const all = [low, high, ...limits].filter(Number.isFinite);
            const [least, most] = [Math.min(...all), Math.max(...all)];
            const room = (most - least || Math.abs(most) || 1) * 0.08;
            return [least - room, most + room];
          },
        },
      },
      height: 220,
    });
  }
}

// Names of components: of three x, y, z, of four w, x, y, z, else numbers.
function componentName(signal, component) {
  const size = signal.values.length;
  if (size === 1) return signal.name;
  const letters = { 3: "xyz", 4: "wxyz" }[size];
  return `${signal.name}.${letters ? letters[component] : component}`;
}

// Every component of every signal of the runs, by name.
const curves = new Map();
data.runs.forEach((run, index) => {
  for (const group of run.groups) {
    for (const signal of group.signals) {
      signal.values.forEach((column, component) => {
        const name = componentName(signal, component);
        if (!curves.has(name)) curves.set(name, { name, unit: signal.unit, of: [] });
        curves.get(name).of[index] ??= { times: group.times, column };
      });
    }
  }
});

// Sets of signals that are shown by one click, where the run has them.
const SETS = [
  ["loads", /^leg\/[^/]+\/foot\/load$/],
  ["hips", /^leg\/[^/]+\/hip\/position$/],
  ["knees", /^leg\/[^/]+\/knee\/position$/],
  ["torques", /^leg\/[^/]+\/(hip|knee)\/torque$/],
  ["trunk", /^body\/position\.[xyz]$/],
  ["attitude", /^body\/rpy\.[xyz]$/],
  ["energy", /^energy balance\//],
  ["wires", /(error|fault|late|lost|retr|dead|miss)/i],
];

class Signals {
  constructor(host) {
    this.chosen = [];
    this.search = make("input", {
      type: "search",
      list: "signal-names",
      placeholder: "add a signal by name",
      title: "Drag over a plot to enlarge a time; double-click to see all",
      "aria-label": "Signal to add",
      onchange: () => this.#add(this.search.value),
    });
    const names = make("datalist", { id: "signal-names" });
    for (const name of curves.keys()) names.append(make("option", { value: name }));
    this.chips = make("div", { class: "chips" });
    this.area = make("div", { class: "plot" });
    const sets = SETS.map(([name, pattern]) => [name, [...curves.keys()].filter((it) => pattern.test(it))]);
    const buttons = sets
      .filter(([, members]) => members.length)
      .map(([name, members]) =>
        make("button", { type: "button", onclick: () => this.show(members.slice(0, 8)) }, name),
      );
    const reset = make("button", { type: "button", onclick: () => this.#draw() }, "whole run");
    host.append(
      make("figure", {}, make("div", { class: "chips" }, ...buttons, reset, this.search, names), this.chips, this.area),
    );
    const parted = data.signals.filter((name) => curves.has(name));
    const first = sets.find(([, members]) => members.length)?.[1] ?? [...curves.keys()].slice(0, 1);
    this.show((parted.length ? parted : first).slice(0, 8));
    this.#enlarge();
  }

  // Opens a long run around its instant.
  #enlarge() {
    const [near, middle] = [0.75, unaligned(...data.open)];
    if (clock.end - clock.start < 4 || !this.plot) return;
    const from = Math.min(Math.max(middle - near, clock.start), clock.end - 2 * near);
    this.plot.setScale("x", { min: from, max: from + 2 * near });
  }

  show(names) {
    this.chosen = names.filter((name) => curves.has(name));
    this.#draw();
  }

  // Components are also known by their numbers, as expectations name them: body/position[2].
  #add(text) {
    const [, signal, number] = text.match(/^(.*)\[(\d)\]$/) ?? [null, text, 0];
    const of = [signal, ..."wxyz", ..."0123"].map((it, i) => (i ? `${signal}.${it}` : it));
    const name = curves.has(text) ? text : of.filter((it) => curves.has(it))[Number(number)];
    this.search.setCustomValidity(name || !text ? "" : `There is no signal ${text} on this page.`);
    this.search.reportValidity();
    if (!name) return;
    this.search.value = "";
    if (!this.chosen.includes(name)) this.show([...this.chosen, name]);
  }

  #draw() {
    discard(this.plot);
    this.chips.replaceChildren(
      ...this.chosen.map((name) =>
        make(
          "button",
          { type: "button", class: "chip", title: "remove", onclick: () => this.show(this.chosen.filter((it) => it !== name)) },
          `${name} ×`,
        ),
      ),
    );
    if (this.chosen.length === 0) return;
    // Two axes at most: the first two units.
    const units = [...new Set(this.chosen.map((name) => inUnit(curves.get(name).unit).unit))].slice(0, 2);
    const shown = this.chosen.filter((name) => units.includes(inUnit(curves.get(name).unit).unit));
    const [tables, series, shade] = [[], [], []];
    shown.forEach((name, i) => {
      const { unit: symbol, of } = curves.get(name);
      const { factor, unit } = inUnit(symbol);
      const [base] = of;
      const pair = of.map((curve, index) => {
        if (!curve) return null;
        const times = numbers(curve.times);
        const values = scaled(numbers(curve.column), factor);
        if (index && base) {
          // At the times of the first run, so that both have a value at each.
          const at = numbers(base.times);
          tables.push([at, resampled(times, values, at.map((t) => aligned(index, t)))]);
        } else {
          tables.push([index ? times.map((t) => unaligned(index, t)) : times, values]);
        }
        const mark = data.runs.length > 1 ? ["A ", "B (dashed) "][index] : "";
        series.push({ label: mark + name, unit, style: colour(`--c${i % 8}`), dash: index ? [6, 4] : undefined, spanGaps: true });
        return series.length;
      });
      if (pair[0] && pair[1]) shade.push([pair[1], pair[0]], [pair[0], pair[1]]);
    });
    this.plot = timePlot(this.area, { rows: joined(merged(tables)), series, shade, height: 300 });
  }
}

// Returns values at the times `at`, linear between samples; nothing outside of them.
function resampled(times, values, at) {
  const end = times[times.length - 1];
  return at.map((t) => {
    if (t < times[0] || t > end) return null;
    const i = indexAt(times, t);
    const j = Math.min(i + 1, times.length - 1);
    if (values[i] === null || values[j] === null || i === j) return values[i];
    return values[i] + ((t - times[i]) / (times[j] - times[i])) * (values[j] - values[i]);
  });
}

// Tables over the same times as one, which need no join.
function merged(tables) {
  const out = [];
  for (const [times, values] of tables) {
    const same = out[out.length - 1];
    if (same && same[0] === times) same.push(values);
    else out.push([times, values]);
  }
  return out;
}
