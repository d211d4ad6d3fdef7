// Time of the run: transport with keys, branches, expectations and events.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 0];
const speedText = (factor) => (factor === 0 ? "max" : `${short(factor)} ×`);

class Transport {
  constructor(host) {
    let isDragged = false;
    this.isHeld = () => isDragged || seeking.isBusy;
    this.play = button("▶", "Play (space)", toggle);
    this.slider = make("input", {
      type: "range",
      min: 0,
      max: live.end_s,
      step: "any",
      "aria-label": "Instant",
      oninput: () => {
        isDragged = true;
        clock.set(Number(this.slider.value));
      },
      onchange: () => (isDragged = false),
    });
    this.marks = make("div", { class: "marks", "aria-hidden": "true" });
    // Marks of events that have gone are removed with them, so that there are few.
    this.markRows = new Keyed(this.marks, (it) => it.key, ({ at, text, kind, sign }) => ({
      element: make("span", { class: kind, title: text, style: `left: ${(100 * at) / live.end_s}%` }, sign),
    }));
    this.track = make("div", { class: "track" }, this.slider, this.marks);
    this.speed = make("select", {
      "aria-label": "Speed",
      title: "Speed",
      onchange: () => request("speed", { factor: Number(this.speed.value) }),
    });
    this.speeds = new Keyed(this.speed, (it) => it, (factor) => ({
      element: make("option", { value: factor }, speedText(factor)),
    }));
    this.time = make("output", { class: "time" });
    this.status = make("span", { class: "soft", role: "status" });
    const steers = [
      this.play,
      (this.back = button("−1 s", "Back 1 s (←)", KEYS.ArrowLeft)),
      button("▶|", "To the next event (n)", KEYS.n),
      button("▶·", "One control step (.)", KEYS["."]),
      this.track,
      this.speed,
    ];
    host.append(...(live.hardware ? [] : steers), this.time, this.status);
  }

  update({ status, speed, reach, branches, branch, events, ended }) {
    const isPlaying = status === "playing";
    const label = isPlaying ? "Pause (space)" : "Play (space)";
    write(this.play, isPlaying ? "❚❚" : "▶");
    this.play.setAttribute("aria-label", label);
    this.play.title = label;
    this.back.disabled = this.slider.disabled = !reach;
    this.track.title = reach
      ? "Ticks: events; ◆: begin of a branch; filled: times that can be set"
      : "This plant has no saved states: it cannot be set back.";
    const known = [...new Set([...SPEEDS, speed])];
    this.speeds.set(known);
    if (document.activeElement !== this.speed) this.speed.value = speed;
    write(this.status, status === "ended" && ended ? `ended: ${ended}` : status);
    const share = (t) => `${(100 * t) / live.end_s}%`;
    const reached = branches.find((it) => it.number === branch)?.reached_s ?? 0;
    this.track.style.setProperty("--from", share(reach?.from_s ?? reached));
    this.track.style.setProperty("--reached", share(reached));
    const begun = branches.filter((it) => it.parent !== null);
    this.markRows.set([
      ...withKeys(events).map(({ at_s: at, text, key }) => ({ key, at, text, kind: "at-event", sign: "" })),
      ...begun.map(({ number, begin_s: at }) => ({ key: number, at, text: `branch ${number}`, kind: "at-branch", sign: "◆" })),
    ]);
    this.tick();
  }

  // Shows the instant, also between two states.
  tick() {
    if (!this.isHeld()) this.slider.value = clock.now;
    const text = `${clock.now.toFixed(3)} s`;
    this.slider.setAttribute("aria-valuetext", text);
    write(this.time, live.hardware ? text : `${text} of ${short(live.end_s)} s`);
  }
}

const toggle = () => request(state?.status === "playing" ? "pause" : "play");

const KEYS = {
  " ": toggle,
  n: () => request("step", { to: "event" }),
  ".": () => request("step", { to: "control" }),
  ArrowLeft: () => clock.set(clock.now - 1),
  ArrowRight: () => clock.set(clock.now + 1),
};

document.addEventListener("keydown", (event) => {
  const action = KEYS[event.key];
  if (!action || live.hardware || event.ctrlKey || event.altKey || event.metaKey) return;
  // Keys that the focused element understands are left to it.
  const { target } = event;
  if (target.closest("input:not([type=range]), select, [contenteditable]")) return;
  if (event.key === " " && target.closest("button")) return;
  if (event.key.startsWith("Arrow") && target.closest(".variable, .scroll")) return;
  event.preventDefault();
  if (!event.repeat || event.key !== " ") action();
});

// Depth of a branch in the tree of branches.
const depth = (branches, { parent }) => {
  const above = branches.find((it) => it.number === parent);
  return above ? 1 + depth(branches, above) : 0;
};

// The branches, each behind the one that it begins in.
function inTree(branches, parent = null) {
  const children = branches.filter((it) => it.parent === parent);
  return children.flatMap((it) => [it, ...inTree(branches, it.number)]);
}

function table(host, heads, label) {
  const body = make("tbody");
  const head = make("thead", {}, make("tr", {}, ...heads.map((name) => make("th", { scope: "col" }, name))));
  host.append(make("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": label }, make("table", {}, head, body)));
  return body;
}

// A row of cells, of which the first `count` are written again on each update.
function row(count, texts, ...rest) {
  const cells = Array.from({ length: count }, () => make("td"));
  const element = make("tr", {}, ...cells, ...rest.map((it) => make("td", {}, it)));
  return { element, update: (item, i) => texts(item, i, element).forEach((text, n) => write(cells[n], text)) };
}

class Branches {
  constructor(host) {
    this.reach = make("p", { class: "soft" });
    const body = table(host, ["branch", "", "begins", "reached", "changes", "scenario"], "Branches");
    const compared = make("div", { "aria-live": "polite" });
    host.append(this.reach, compared);
    this.rows = new Keyed(body, (it) => it.number, (branch) => {
      const go = button("go to", `Go to branch ${branch.number}`, () => request("branch", { number: branch.number, at_s: null }));
      const compare = button("compare", `Compare branch ${branch.number} with the one that is shown`, async () => {
        const response = await request("compare", { one: state.branch, other: branch.number });
        if (response) compared.replaceChildren(...comparison(response.futures));
      });
      const file = make("code", {}, branch.file ?? "");
      const texts = (it, _, element) => {
        const isShown = state.branch === it.number;
        element.setAttribute("aria-current", String(isShown));
        go.disabled = compare.disabled = isShown;
        const indent = "\u2003".repeat(Math.max(depth(state.branches, it) - 1, 0)) + (it.parent === null ? "" : "└ ");
        write(file, it.file ?? "");
        const name = `${indent}${it.number}${isShown ? " (shown)" : ""}`;
        return [name, `${it.begin_s.toFixed(3)} s`, `${it.reached_s.toFixed(3)} s`, String(it.acts)];
      };
      const shown = row(4, texts, file);
      shown.element.firstChild.after(make("td", {}, go, compare));
      return shown;
    });
  }

  update({ branches, reach }) {
    this.rows.set(inTree(branches));
    const mebibytes = (bytes) => short(Number((bytes / 2 ** 20).toPrecision(3)));
    const text = reach
      ? `A change in the past begins a branch. The run can be set to any time from ${reach.from_s.toFixed(3)} s: ` +
        `${reach.count} saved states, every ${short(reach.spacing_s)} s, ` +
        `${mebibytes(reach.bytes)} of ${mebibytes(reach.limit)} MiB.`
      : "This plant has no saved states: it cannot be set back, and has no branches.";
    write(this.reach, text);
  }
}

// Footsteps of two branches, side by side, and their differences.
function comparison({ branches: [a, b], window_s: [from, to], pairs, alone }) {
  const caption = `Branches ${a} and ${b} are the same run up to ${from.toFixed(3)} s; footsteps up to ${to.toFixed(3)} s:`;
  const nodes = [make("p", {}, caption)];
  const host = make("div");
  const signed = (value, digits) => `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(digits)}`;
  const difference = ([one, other], scale, digits) => signed((other - one) * scale, digits);
  const body = table(host, ["leg", `touch-down, ${a}`, `${b} − ${a}`, "stance", "forward", "left"], "Footsteps of two branches");
  for (const { leg, touch_down_s, stance_s, position_m } of pairs) {
    const moved = (axis) => (position_m.includes(null) ? "" : `${difference(position_m.map((at) => at[axis]), 1e3, 1)} mm`);
    const cells = [leg, `${touch_down_s[0].toFixed(3)} s`, `${difference(touch_down_s, 1e3, 1)} ms`, `${difference(stance_s, 1e3, 1)} ms`, moved(0), moved(1)];
    body.append(make("tr", {}, ...cells.map((text) => make("td", {}, text))));
  }
  nodes.push(host);
  if (pairs.length === 0) nodes.push(make("p", { class: "soft" }, "They have no footstep in common since then."));
  if (alone.length) {
    const list = alone.map(([branch, leg, at]) => `${leg} at ${at.toFixed(3)} s in ${branch}`);
    nodes.push(make("p", {}, `In one alone: ${list.join("; ")}.`));
  }
  return nodes;
}

const VERDICTS = { pass: "✓ pass", fail: "✗ fail", unobserved: "○ unobserved" };

class Expectations {
  constructor(host) {
    this.none = make("p", { class: "soft" }, "The scenario has no expectations.");
    host.append(this.none);
    const body = table(host, ["expectation", "so far", "measured", "bound"], "Expectations");
    this.scroll = body.closest(".scroll");
    this.rows = new Keyed(body, (it) => it.name, () =>
      row(4, ({ name, verdict, measured, bound }, _, element) => {
        element.className = verdict;
        return [name, VERDICTS[verdict] ?? verdict, measured ?? "", bound ?? ""];
      }),
    );
  }

  update({ expectations }) {
    this.none.hidden = expectations.length > 0;
    this.scroll.hidden = expectations.length === 0;
    this.rows.set(expectations);
  }
}

// Gives each event a key of its own; equal events at one instant are counted.
function withKeys(events) {
  const counts = new Map();
  return events.map((event) => {
    const name = `${event.at_s} ${event.text}`;
    counts.set(name, (counts.get(name) ?? 0) + 1);
    return { ...event, key: `${name} ${counts.get(name)}` };
  });
}

class Events {
  constructor(host) {
    const list = make("ol", { class: "events scroll", tabindex: "0", "aria-label": "Newest events" });
    this.rows = new Keyed(list, (it) => it.key, ({ at_s: at, text }) => {
      const time = `${at.toFixed(3)} s`;
      const go = live.hardware ? time : button(time, `Go to ${time}, ${text}`, () => clock.set(at), { class: "link" });
      return { element: make("li", {}, go, ` ${text}`) };
    });
    this.none = make("p", { class: "soft" }, "None so far.");
    host.append(this.none, list);
    this.list = list;
  }

  update({ events }) {
    this.none.hidden = events.length > 0;
    this.list.hidden = events.length === 0;
    this.rows.set(withKeys(events).reverse());
  }
}
