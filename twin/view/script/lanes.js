// Gait diagram: a lane for each leg, and one for what is done to the run and what happens in it.

const ROW = 18;
const LEFT = 44;
const RIGHT = 18;
const TICKS = 20;

const KINDS = {
  push: { colour: "--c1", mark: "▼" },
  fault: { colour: "--bad", mark: "✕" },
  change: { colour: "--c6", mark: "◆" },
  event: { colour: "--c4", mark: "●" },
  violation: { colour: "--bad", mark: "▲" },
  end: { colour: "--bad", mark: "■" },
};

class Lanes {
  // `span` is the shown time around the slider; without it the whole run is shown.
  constructor(label, span) {
    this.span = span;
    this.rows = data.runs.flatMap((run, index) => [
      ...run.gait.map((gait, leg) => ({ index, gait, leg })),
      { index, incidents: run.incidents.filter((it) => it.kind !== "touch-down") },
    ]);
    this.height = this.rows.length * ROW + TICKS;
    this.canvas = make("canvas", { class: "lanes", style: `height: ${this.height}px`, title: "" });
    this.element = make("figure", { class: "gait" }, make("figcaption", {}, label), this.canvas);
    const drag = (event) => {
      if (event.buttons & 1) clock.set(this.#time(event));
    };
    this.canvas.addEventListener("pointerdown", drag);
    if (!span) this.canvas.addEventListener("pointermove", drag);
    this.canvas.addEventListener("pointermove", (event) => this.#describe(event));
  }

  get #window() {
    if (!this.span) return [clock.start, clock.end];
    const last = Math.max(clock.end - this.span, clock.start);
    const from = Math.min(Math.max(clock.now - this.span / 2, clock.start), last);
    return [from, from + this.span];
  }

  #time(event) {
    const [from, to] = this.#window;
    const box = this.canvas.getBoundingClientRect();
    return from + ((event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT)) * (to - from);
  }

  #describe(event) {
    const t = this.#time(event);
    const box = this.canvas.getBoundingClientRect();
    const row = this.rows[Math.floor((event.clientY - box.top) / ROW)];
    const [from, to] = this.#window;
    const near = ((to - from) / box.width) * 6;
    const found = (row?.incidents ?? []).filter((it) => {
      const at = unaligned(row.index, it.at);
      return t >= at - near && t <= (it.until ? unaligned(row.index, it.until) : at) + near;
    });
    const text = found.map((it) => `${it.at.toFixed(3)} s: ${it.text}`).join("\n");
    this.canvas.title = text || `${t.toFixed(3)} s`;
  }

  draw() {
    const shown = fitted(this.canvas);
    if (!shown) return;
    const { context, width, height } = shown;
    const [from, to] = this.#window;
    const x = (t) => LEFT + ((t - from) / (to - from)) * (width - LEFT - RIGHT);
    context.font = "11px system-ui, sans-serif";
    context.textBaseline = "middle";
    this.#ticks(context, x, from, to, height);
    this.rows.forEach((row, i) => {
      const y = i * ROW;
      context.fillStyle = colour("--soft");
      context.textAlign = "right";
      const mark = data.runs.length > 1 ? `${"AB"[row.index]} ` : "";
      context.fillText(mark + (row.gait ? row.gait.leg : "events"), LEFT - 6, y + ROW / 2);
      const at = (t) => x(unaligned(row.index, t));
      context.save();
      context.beginPath();
      context.rect(LEFT, y, width - LEFT, ROW);
      context.clip();
      if (row.gait) this.#leg(context, row, at, y, from, to);
      else this.#incidents(context, row, at, y);
      context.restore();
    });
    context.fillStyle = colour("--ink");
    context.fillRect(x(clock.now) - 0.75, 0, 1.5, height - TICKS);
  }

  #ticks(context, x, from, to, height) {
    const rough = (to - from) / 8;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough);
    context.textAlign = "center";
    for (let i = Math.ceil(from / step); i * step <= to + 1e-9; i += 1) {
      context.fillStyle = colour("--faint");
      context.fillRect(x(i * step), 0, 1, height - TICKS);
      context.fillStyle = colour("--soft");
      const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
      context.fillText(`${(i * step).toFixed(places)} s`, x(i * step), height - TICKS / 2);
    }
  }

  // A footstep is outlined; its contacts are filled, so that a bounce is a gap within it.
  #leg(context, row, at, y, from, to) {
    const within = ([begin, end]) => unaligned(row.index, end) >= from && unaligned(row.index, begin) <= to;
    context.fillStyle = legColour(row.leg);
    for (const contact of row.gait.contacts.filter(within)) {
      const [a, b] = contact.map(at);
      context.fillRect(a, y + 5, Math.max(b - a, 1), ROW - 10);
    }
    context.strokeStyle = legColour(row.leg);
    context.lineWidth = 1;
    for (const step of row.gait.footsteps.filter((it) => within([it.from, it.to]))) {
      const [a, b] = [at(step.from), at(step.to)];
      context.strokeRect(a, y + 2.5, Math.max(b - a, 1), ROW - 5);
    }
  }

  #incidents(context, row, at, y) {
    context.textAlign = "center";
    for (const incident of row.incidents) {
      const style = KINDS[incident.kind];
      const a = at(incident.at);
      context.fillStyle = colour(style.colour);
      if (incident.until !== undefined) {
        context.globalAlpha = 0.35;
        context.fillRect(a, y + 4, Math.max(at(incident.until) - a, 2), ROW - 8);
        context.globalAlpha = 1;
      }
      context.fillText(style.mark, a, y + ROW / 2);
    }
  }
}
