// Plots of chosen signals over the last seconds. Only groups with a chosen signal are subscribed.

const SPANS_S = [5, 10, 20];
const SAMPLES_MAX = 1 << 15; // 20 s of samples each 0.6 ms
const GAP_S = 0.25; // a run that is set forward has a gap
const CURVES_MAX = 8;
const FRAME_MS = 80; // period of drawing

// Samples of the chosen components of a group, the newest of which stay.
class Ring {
  constructor() {
    this.times = new Float64Array(SAMPLES_MAX);
    this.columns = new Map(); // by place in the message
    this.clear();
  }

  clear() {
    [this.start, this.count] = [0, 0];
  }

  #at(i) {
    return (this.start + i) % SAMPLES_MAX;
  }

  get newest() {
    return this.count ? this.times[this.#at(this.count - 1)] : -Infinity;
  }

  // Removes the samples from `t` on, which a run that is set back has yet to have.
  truncate(t) {
    while (this.count && this.newest >= t) this.count -= 1;
  }

  #push(t, value) {
    if (this.count === SAMPLES_MAX) this.start = this.#at(1);
    else this.count += 1;
    const index = this.#at(this.count - 1);
    this.times[index] = t;
    for (const [place, column] of this.columns) column[index] = value(place);
  }

  add(t, view, offset) {
    this.truncate(t);
    if (this.count && t - this.newest > GAP_S) this.#push(this.newest + 1e-9, () => NaN);
    this.#push(t, (place) => view.getFloat64(offset + 8 * place, true));
  }

  choose(places) {
    for (const place of this.columns.keys()) if (!places.has(place)) this.columns.delete(place);
    for (const place of places) {
      if (!this.columns.has(place)) this.columns.set(place, new Float64Array(SAMPLES_MAX).fill(NaN));
    }
  }

  // Returns times from `from` on, and the values of some places; none are null.
  rows(from, places) {
    let first = this.count;
    while (first && this.times[this.#at(first - 1)] >= from) first -= 1;
    const list = (array) => Array.from({ length: this.count - first }, (_, i) => array[this.#at(first + i)]);
    return [list(this.times), ...places.map((place) => list(this.columns.get(place)).map((it) => (Number.isNaN(it) ? null : it)))];
  }
}

class LiveSignals {
  constructor(host) {
    this.rings = new Map(); // by topic
    this.chosen = [];
    this.span = SPANS_S[1];
    this.drawnAt = 0;
    this.search = make("input", {
      type: "search",
      list: "signal-names",
      placeholder: "add a signal by name",
      "aria-label": "Signal to add",
      onchange: () => this.#add(this.search.value.trim()),
    });
    this.names = make("datalist", { id: "signal-names" });
    this.sets = make("span", { class: "chips" });
    this.spans = make("select", { "aria-label": "Shown time", onchange: () => this.#resize() });
    for (const span of SPANS_S) this.spans.append(make("option", { value: span, selected: span === this.span }, `last ${span} s`));
    this.chips = make("div", { class: "chips" });
    this.area = make("div", { class: "plot" });
    host.append(make("figure", {}, make("div", { class: "chips" }, this.spans, this.sets, this.search, this.names), this.chips, this.area));
  }

  // Lists the signals of new channels; a channel of a restarted server replaces its predecessor.
  advertised(channels) {
    for (const { topic, metadata } of channels) {
      if (!metadata?.signals) continue;
      let place = 0;
      for (const signal of JSON.parse(metadata.signals)) {
        const values = new Array(signal.size);
        for (let component = 0; component < signal.size; component += 1, place += 1) {
          const name = componentName({ ...signal, values }, component);
          const other = curves.get(name);
          if (!other || other.topic === topic) curves.set(name, { unit: signal.unit, topic, place });
        }
      }
    }
    const names = [...curves.keys()].sort();
    this.names.replaceChildren(...names.map((name) => make("option", { value: name })));
    const sets = SETS.map(([name, pattern]) => [name, names.filter((it) => pattern.test(it))]);
    const known = sets.filter(([, members]) => members.length);
    this.sets.replaceChildren(
      ...known.map(([name, members]) => make("button", { type: "button", onclick: () => this.show(members) }, name)),
    );
    this.show(this.chosen.length ? this.chosen : (known[0]?.[1] ?? names.slice(0, 1)));
  }

  #add(name) {
    const isFull = this.chosen.length >= CURVES_MAX;
    const problem = !curves.has(name) ? `There is no signal ${name}.` : isFull ? `At most ${CURVES_MAX} signals are plotted.` : "";
    this.search.setCustomValidity(name ? problem : "");
    this.search.reportValidity();
    if (!name || problem) return;
    this.search.value = "";
    if (!this.chosen.includes(name)) this.show([...this.chosen, name]);
  }

  show(names) {
    this.chosen = names.filter((name) => curves.has(name)).slice(0, CURVES_MAX);
    const wanted = Map.groupBy(this.chosen, (name) => curves.get(name).topic);
    for (const topic of this.rings.keys()) {
      if (wanted.has(topic)) continue;
      connection.unsubscribe(topic);
      this.rings.delete(topic);
    }
    for (const [topic, members] of wanted) {
      const ring = this.rings.get(topic) ?? new Ring();
      ring.choose(new Set(members.map((name) => curves.get(name).place)));
      if (this.rings.has(topic)) continue;
      this.rings.set(topic, ring);
      connection.subscribe(topic, (at, view, offset) => {
        // Four bytes of header come before the numbers.
        ring.add(Number(at - EPOCH_NS) / 1e9, view, offset + 4);
        this.isNew = true;
        schedule();
      });
    }
    this.#build();
    const remove = (name) => this.show(this.chosen.filter((it) => it !== name));
    const text = (name) => (this.shown.some((it) => it.name === name) ? name : `${name} (not plotted: a third unit)`);
    this.chips.replaceChildren(
      ...this.chosen.map((name) => button(`${text(name)} ×`, `Remove ${name} from the plot`, () => remove(name), { class: "chip" })),
    );
  }

  // Samples of another branch are not of the shown one, except those before it begins.
  branchChanged(before, after) {
    for (const ring of this.rings.values()) {
      if (after.parent === before) ring.truncate(after.begin_s);
      else ring.clear();
    }
  }

  clear() {
    for (const ring of this.rings.values()) ring.clear();
  }

  #resize() {
    this.span = Number(this.spans.value);
    this.draw(true);
  }

  #rows() {
    const tables = [];
    for (const [topic, ring] of this.rings) {
      const shown = this.shown.filter((it) => it.topic === topic);
      if (!shown.length) continue;
      const [times, ...values] = ring.rows(clock.now - this.span, shown.map((it) => it.place));
      tables.push([times, ...values.map((column, i) => scaled(column, inUnit(shown[i].unit).factor))]);
    }
    return joined(tables);
  }

  #build() {
    discard(this.plot);
    this.plot = null;
    this.shown = [];
    if (this.chosen.length === 0) return;
    // Two axes at most: the first two units. Curves follow in the order of the tables.
    const all = this.chosen.map((name, i) => ({ ...curves.get(name), name, style: colour(`--c${i}`) }));
    const units = [...new Set(all.map((it) => inUnit(it.unit).unit))].slice(0, 2);
    const known = all.filter((it) => units.includes(inUnit(it.unit).unit));
    this.shown = [...this.rings.keys()].flatMap((topic) => known.filter((it) => it.topic === topic));
    const series = this.shown.map(({ name, unit, style }) => ({ label: name, unit: inUnit(unit).unit, style }));
    this.plot = timePlot(this.area, { rows: this.#rows(), series, height: 300 });
    this.draw(true);
  }

  // Draws new samples; returns whether it has yet to.
  draw(isForced) {
    const at = performance.now();
    if (!this.plot || !(this.isNew || isForced)) return false;
    if (!isForced && at - this.drawnAt < FRAME_MS) return true;
    [this.drawnAt, this.isNew] = [at, false];
    const rows = this.#rows();
    this.plot.setData(rows, false);
    const from = Math.max(clock.now - this.span, 0);
    this.plot.setScale("x", { min: from, max: from + this.span });
    // Each curve has its own newest sample.
    const newest = rows.map((row) => row.findLastIndex((it) => it !== null && it !== undefined));
    if (this.plot.cursor.left < 0 && newest[0] >= 0) this.plot.setLegend({ idxs: newest });
    return false;
  }
}
