// The page of a live run. Order of the files, in one module behind the library uPlot:
//
//   data.js              numbers, elements, colours; `data` has no runs here
//   live/protocol.js     connection
//   live/state.js        data.runs, clock, aligned, unaligned, for the two that follow
//   figure.js, plots.js  drawing
//   live/sliders.js, live/controls.js, live/gamepad.js, live/signals.js, live/main.js
//
// Elements: <script type="application/json" id="live-data">, and those of live.html.

const figures = [];
if (liveRun.figure) {
  for (const view of Object.keys(VIEWS)) figures.push(new Figure(liveRun, 0, view));
  byId("robot").append(make("div", { class: "views" }, ...figures.map((it) => it.element)));
} else {
  const why = live.hardware ? "On hardware the pose of the robot is not measured" : "The robot has no coordinate frames";
  byId("robot").append(make("p", { class: "soft" }, `${why}, so that there is no figure of it.`));
}

document.title = `${live.title}, live`;
byId("title").textContent = live.title;
byId("headline").textContent = `${live.scenario}, ${live.hardware ? "on hardware" : `plant ${live.plant}`}`;

const transport = new Transport(byId("transport"));
const signals = new LiveSignals(byId("signals"));
if (live.hardware) byId("branches").closest("section").remove();
const parts = [
  transport,
  new Variables(byId("variables")),
  new Sets(byId("sets")),
  new Gamepads(byId("gamepads")),
  new Expectations(byId("expectations")),
  new Events(byId("events")),
  ...(live.hardware ? [] : [new Branches(byId("branches"))]),
];

// Draws at most once in a frame of the screen, and not at all while the page is hidden.
let drawing = null;
function schedule() {
  drawing ??= requestAnimationFrame(() => {
    drawing = null;
    transport.tick();
    drawFigures();
    if (signals.draw()) schedule();
  });
}

function drawFigures() {
  if (liveRun.figure?.times.length) for (const figure of figures) figure.draw(clock.now);
}

function stateChanged(_, view, offset) {
  const before = state;
  state = json(view, offset);
  clock.now = state.now_s;
  if (before && before.branch !== state.branch) {
    signals.branchChanged(before.branch, state.branches.find((it) => it.number === state.branch));
  }
  // A refusal is in the answer to its request as well, and may have been shown.
  const isNew = state.message && before?.message !== state.message;
  if (isNew && !byId("message").textContent.endsWith(state.message)) say(state.message, false);
  for (const part of parts) part.update(state);
  // The plot follows the time also without new samples.
  signals.isNew ||= before?.now_s !== state.now_s;
  document.documentElement.dataset.ready = "true";
  schedule();
}

function frameChanged(_, view, offset) {
  const frame = json(view, offset);
  clock.now = frame.t;
  if (liveRun.figure) addFrame(liveRun.figure, frame);
  schedule();
}

let session = null;
function showConnection(text) {
  byId("connection").textContent = text;
  document.body.classList.toggle("disconnected", !connection.isOpen);
}

const connection = new Connection(`ws://${location.hostname}:${live.socket}/`, {
  connected: (id) => {
    // Another session has another past.
    if (session !== null && session !== id) signals.clear();
    session = id;
    showConnection("● connected");
  },
  disconnected: (retryMs) => showConnection(`○ not connected; next attempt in ${short(retryMs / 1000)} s`),
  advertised: (channels) => signals.advertised(channels),
  failed: (text) => say(text, false),
});
connection.subscribe("/live/state", stateChanged);
connection.subscribe("/live/frame", frameChanged);
connection.open();

new ResizeObserver(drawFigures).observe(byId("robot"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  signals.show(signals.chosen);
  drawFigures();
});
// For tests, and for readers with a console.
globalThis.twinrig = { clock, connection, signals, state: () => state };
