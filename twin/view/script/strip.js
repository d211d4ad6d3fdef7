// Bytes of the buses around the instant of the slider, and histograms of the timing.

class Strip {
  constructor(host) {
    this.body = make("tbody");
    this.note = make("p", { class: "soft" });
    const head = ["", "instant", "trace", "frames", "bytes"].map((name) => make("th", {}, name));
    host.append(
      this.note,
      make(
        "div",
        { class: "scroll bytes", tabindex: "0" },
        make("table", {}, make("thead", {}, make("tr", {}, ...head)), this.body),
      ),
    );
    this.runs = data.runs.map((run) => run.wires);
    this.at = this.runs.map((wires) => wires?.pieces.map((piece) => piece[0]) ?? []);
  }

  draw(t) {
    const rows = this.runs.flatMap((wires, index) => (wires ? this.#rows(wires, index, aligned(index, t)) : []));
    const faults = data.runs.flatMap((run) => run.incidents.filter((it) => it.kind === "fault"));
    const active = faults.filter((it) => it.at <= t && t <= (it.until ?? it.at));
    const faulty = active.map((it) => it.text).join("; ");
    const kept = this.runs.find((wires) => wires?.windows.length);
    const inside = !kept || kept.windows.some(([from, to]) => from <= t && t <= to);
    const missing = "Bytes are kept around the start and the events; step to one with ◀ or ▶. ";
    this.note.textContent = `${inside ? "" : missing}${faulty ? `Active: ${faulty}.` : ""}`;
    this.body.replaceChildren(...rows);
  }

  // The pieces around `t`, if there are any near it: six before it, twelve from it on.
  #rows(wires, index, t) {
    const times = this.at[index];
    if (times.length === 0) return [];
    const now = indexAt(times, t);
    const near = wires.windows.length ? 0.06 : Infinity;
    const [first, last] = [Math.max(0, now - 6), now + 12];
    const shown = wires.pieces.slice(first, last).filter(([at]) => Math.abs(at - t) < near);
    return shown.map((piece) => {
      const [at, trace, bytes, frames] = piece;
      const isNow = piece === wires.pieces[now];
      const mark = data.runs.length > 1 ? "AB"[index] : "";
      const cells = [mark + (isNow ? "▶" : ""), `${at.toFixed(6)} s`, wires.traces[trace], frames.join("; "), bytes];
      const go = () => clock.set(unaligned(index, at));
      const row = make("tr", { class: isNow ? "now" : null, onclick: go });
      cells.forEach((text, n) => row.append(make("td", { class: n === 4 ? "hex" : null }, text)));
      return row;
    });
  }
}

// Draws histograms as SVG; durations that are all equal are in the table alone.
function histograms(host) {
  const [width, height, base] = [420, 150, 118];
  data.runs.forEach((run, index) => {
    for (const histogram of run.timing) {
      if (histogram.counts.length < 2) continue;
      const most = Math.max(...histogram.counts);
      const bar = (width - 20) / histogram.counts.length;
      const svg = make("svg:svg", {
        viewBox: `0 0 ${width} ${height}`,
        role: "img",
        "aria-label": `${histogram.title}: ${quantity(histogram.least, "s")} to ${quantity(histogram.greatest, "s")}`,
      });
      histogram.counts.forEach((count, i) => {
        // A single outlier stays visible.
        const size = count ? Math.max(2, (count / most) * (base - 12)) : 0;
        const from = quantity(histogram.from + i * histogram.width, "s");
        svg.append(
          make(
            "svg:rect",
            { x: 10 + i * bar, y: base - size, width: Math.max(bar - 0.6, 0.8), height: size, class: `c${index}` },
            make("svg:title", {}, `from ${from}: ${count}`),
          ),
        );
      });
      const end = histogram.from + histogram.width * histogram.counts.length;
      svg.append(
        make("svg:text", { x: 10, y: base + 18 }, quantity(histogram.from, "s")),
        make("svg:text", { x: width - 10, y: base + 18, class: "end" }, quantity(end, "s")),
        make("svg:text", { x: width / 2, y: base + 18, class: "middle" }, `median ${quantity(histogram.median, "s")}`),
      );
      const mark = data.runs.length > 1 ? `${"AB"[index]}: ` : "";
      host.append(make("figure", {}, make("h3", {}, mark + histogram.title), svg));
    }
  });
  host.classList.add("pair");
}
