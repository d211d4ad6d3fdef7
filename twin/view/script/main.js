// The page: stage with the slider, and the parts below that follow it.

const byId = (id) => document.getElementById(id);
const figures = [];
const lanes = [];
let course = null;
let strip = null;

function stage(host) {
  const shown = data.runs.map((run, index) => [run, index]).filter(([run]) => run.figure);
  const views = make("div", { class: "views" });
  for (const [run, index] of shown) {
    for (const view of Object.keys(VIEWS)) {
      const figure = new Figure(run, index, view);
      figures.push(figure);
      views.append(figure.element);
    }
  }
  if (shown.length === 0) {
    views.append(make("p", { class: "soft" }, "The run has no coordinate frames, so that there is no figure of a robot."));
  }
  const walks = data.runs.some((run) => run.gait.length);
  const near = 1.5;
  if (walks && clock.end > 2 * near) lanes.push(new Lanes("gait around the instant", near));
  if (walks) lanes.push(new Lanes("gait of the whole run: filled contact, outlined footstep", null));
  else if (events.length) lanes.push(new Lanes("events of the run", null));
  const aligned = "B is aligned with A by its footsteps; its instants are those of its own time.";
  host.append(views, controls(), ...lanes.map((it) => it.element), legend());
  if (data.runs.length > 1) host.append(make("p", { class: "soft" }, aligned));
}

function legend() {
  const used = new Set(events.map((event) => event.kind));
  const names = { push: "push", fault: "fault", change: "change", event: "event of the schedule", violation: "expectation violated", end: "fall, or end by an error" };
  const items = Object.entries(names)
    .filter(([kind]) => used.has(kind))
    .map(([kind, text]) =>
      make("li", {}, make("span", { style: `color: var(${KINDS[kind].colour})`, "aria-hidden": "true" }, KINDS[kind].mark), text),
    );
  return make("ul", { class: "legend" }, ...items);
}

function controls() {
  const button = (text, label, action) => make("button", { type: "button", "aria-label": label, title: label, onclick: action }, text);
  const play = button("▶", "Play or pause (space)", () => clock.toggle());
  const slider = make("input", {
    type: "range",
    id: "slider",
    min: clock.start,
    max: clock.end,
    step: "any",
    "aria-label": "Instant",
    oninput: () => clock.set(Number(slider.value)),
  });
  const time = make("output", { for: "slider", class: "time" });
  const event = make("output", { class: "event", "aria-live": "polite" });
  const speed = make("select", { "aria-label": "Speed", onchange: () => (clock.speed = Number(speed.value)) });
  for (const factor of [1, 0.5, 0.25, 0.1, 0.02]) {
    speed.append(make("option", { value: factor, selected: factor === (clock.end > 5 ? 1 : 0.25) }, `${factor} ×`));
  }
  clock.speed = Number(speed.value);
  clock.listen((now) => {
    slider.value = now;
    slider.setAttribute("aria-valuetext", instantText(now));
    time.textContent = instantText(now);
    play.textContent = clock.isPlaying ? "❚❚" : "▶";
    const last = clock.events.findLast((it) => it.at <= now + 1e-6);
    const mark = last && data.runs.length > 1 ? `${"AB"[last.run]} ` : "";
    event.textContent = last ? `${mark}${last.own.toFixed(3)} s: ${last.text}` : "";
    event.title = event.textContent;
  });
  return make(
    "div",
    { class: "controls", role: "toolbar", "aria-label": "Time" },
    play,
    button("|◀", "Event before (,)", () => clock.step(-1)),
    button("▶|", "Next event (.)", () => clock.step(1)),
    slider,
    time,
    speed,
    event,
  );
}

const KEYS = {
  " ": () => clock.toggle(),
  ",": () => clock.step(-1),
  ".": () => clock.step(1),
  ArrowLeft: (event) => clock.set(clock.now - (event.shiftKey ? 0.1 : 0.005)),
  ArrowRight: (event) => clock.set(clock.now + (event.shiftKey ? 0.1 : 0.005)),
  Home: () => clock.set(clock.start),
  End: () => clock.set(clock.end),
};

document.addEventListener("keydown", (event) => {
  const isTyping = event.target.closest("input[type=search], select, button");
  const action = KEYS[event.key];
  if (!action || isTyping || event.ctrlKey || event.altKey || event.metaKey) return;
  event.preventDefault();
  action(event);
});

// Links of the tables: to an instant, or to an expectation.
function follow() {
  const [, key, value] = location.hash.match(/^#(t=|b=|expectation-)(.+)$/) ?? [];
  if ((key === "t=" || key === "b=") && Number.isFinite(Number(value))) {
    clock.pause();
    clock.set(unaligned(key === "b=" ? 1 : 0, Number(value)));
  } else if (key && course) {
    course.show(Number(value));
    const at = data.runs[0].judged.expectations[Number(value)]?.at;
    if (at !== null && at !== undefined) clock.set(at);
  }
}

// Marks the instant in a plot, and shows its values there unless the pointer is in it.
function mark(plot) {
  if (plot.cursor.left < 0) plot.setLegend({ idx: indexAt(plot.data[0], clock.now) });
  plot.redraw(false);
}

function drawStage() {
  for (const figure of figures) figure.draw(clock.now);
  for (const lane of lanes) lane.draw();
}

stage(byId("stage"));
if (byId("course")) course = new Course(byId("course"));
if (byId("signals")) new Signals(byId("signals"));
if (byId("strip")) strip = new Strip(byId("strip"));
if (byId("timing")) histograms(byId("timing"));

const { expectations } = data.runs[data.open[0]].judged;
course?.show(Math.max(expectations.findIndex((it) => it.verdict === "fail"), 0));

let drawn = null;
clock.listen((now) => {
  if (drawn !== null) return;
  drawn = requestAnimationFrame(() => {
    drawn = null;
    drawStage();
    strip?.draw(clock.now);
    for (const plot of plots) mark(plot);
  });
});
new ResizeObserver(drawStage).observe(byId("stage"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => location.reload());
window.addEventListener("hashchange", follow);
clock.set(unaligned(...data.open));
follow();
// For tests, and for readers with a console.
globalThis.twinrig = { clock, runs: data.runs, pose: (index, t) => pose(data.runs[index].figure, t) };
document.documentElement.dataset.ready = "true";
