// State of the page: its data, the instant that it shows, requests and the newest poses. It gives
// the drawing code of recorded runs the names that it needs: data.runs, clock, aligned, unaligned.

const byId = (id) => document.getElementById(id);
const live = JSON.parse(byId("live-data").textContent);
const EPOCH_NS = BigInt(live.epoch_ns);
let state = null;

const liveRun = { figure: live.figure && withColumns(live.figure), incidents: [], groups: [] };
data.runs.push(liveRun);
const aligned = (_, t) => t;
const unaligned = aligned;

// A click on a plot, a mark or an event seeks.
const clock = { now: 0, set: (t) => !live.hardware && state?.reach && seeking.put(within(t)) };

// Returns the nearest time to which the run can be set.
function within(t) {
  const reached = state.branches.find((it) => it.number === state.branch)?.reached_s ?? state.now_s;
  return Math.min(Math.max(t, state.reach.from_s), Math.max(reached, state.now_s));
}

// Shows a refusal or a note; its element is read aloud.
let messages = 0;
function say(text, isRefusal) {
  messages += 1;
  write(byId("message"), text ? `${isRefusal ? "Not done: " : ""}${text}` : "");
  byId("message").classList.toggle("bad", isRefusal);
}

// Calls a service; returns whether the server accepts. A message of an earlier request goes then,
// but not one that the state brought while the answer was on its way.
async function request(name, body = {}) {
  const before = messages;
  try {
    const response = await connection.call(name, body);
    if (messages === before) say("", false);
    return response;
  } catch (error) {
    say(error.message, true);
    return null;
  }
}

// Sends the newest of a stream of values: one request at a time, at most 20 in a second. Values
// that come in between are replaced, not queued.
class Latest {
  constructor(send) {
    this.send = send;
    this.isBusy = false;
    this.value = null;
  }

  async put(value) {
    this.value = value;
    if (this.isBusy) return;
    this.isBusy = true;
    while (this.value !== null) {
      const newest = this.value;
      this.value = null;
      await Promise.all([this.send(newest), new Promise((done) => setTimeout(done, 50))]);
    }
    this.isBusy = false;
  }
}

const seeking = new Latest((t) => request("seek", { at_s: t }));

// Poses of the last instants, from which the figure and the paths of the feet are drawn.
const PATH_S = 0.6;
const FRAMES_MAX = 600;

function withColumns(figure) {
  const axes = (count) => Array.from({ length: count }, () => []);
  const legs = figure.legs.map((leg) => ({
    ...leg,
    angles: axes(3),
    force: axes(3),
    abduction: leg.abduction && { ...leg.abduction, angle: [] },
  }));
  return { ...figure, times: [], trunk: axes(7), push: axes(3), contact: axes(3), legs };
}

function addFrame(figure, frame) {
  const { times } = figure;
  const rows = [
    [figure.trunk, frame.trunk],
    [figure.push, frame.push ?? [0, 0, 0]],
    [figure.contact, frame.contact ?? [0, 0, 0]],
    ...figure.legs.flatMap((leg, i) => [
      [leg.angles, frame.angles[i] ?? [0, 0, 0]],
      [leg.force, frame.force?.[i] ?? [0, 0, 0]],
      ...(leg.abduction ? [[[leg.abduction.angle], [frame.abduction?.[i] ?? 0]]] : []),
    ]),
  ];
  const columns = rows.flatMap(([axes]) => axes);
  const remove = (from, count) => [times, ...columns].forEach((column) => column.splice(from, count));
  // A run that is set back, or forward by more than a path is long, begins a new path.
  const later = times.findIndex((t) => t >= frame.t);
  if (later >= 0) remove(later, times.length);
  if (frame.t - times[times.length - 1] > PATH_S) remove(0, times.length);
  const old = times.findIndex((t) => t >= frame.t - PATH_S);
  if (old > 0) remove(0, old);
  if (times.length === FRAMES_MAX) remove(0, 1);
  times.push(frame.t);
  for (const [axes, values] of rows) axes.forEach((axis, i) => axis.push(values[i]));
}

// Keeps the children of an element equal to a list without making anew those that stay, so that
// focus and clicks last. `create(item)` returns an element and a function that updates it.
class Keyed {
  constructor(host, key, create) {
    Object.assign(this, { host, key, create, shown: new Map() });
  }

  set(items) {
    const keys = items.map(this.key);
    for (const [key, { element }] of this.shown) {
      if (keys.includes(key)) continue;
      element.remove();
      this.shown.delete(key);
    }
    items.forEach((item, i) => {
      if (!this.shown.has(keys[i])) this.shown.set(keys[i], this.create(item));
      const { element, update } = this.shown.get(keys[i]);
      if (this.host.children[i] !== element) this.host.insertBefore(element, this.host.children[i] ?? null);
      update?.(item, i);
    });
  }
}

// Sets the text of an element where it differs: writing equal text would end a selection in it.
function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

const short = (value) => String(Number(value.toPrecision(6)));
const withUnit = (value, unit) => (unit === "1" || unit === "" ? short(value) : `${short(value)} ${unit}`);
const button = (text, label, action, attributes = {}) =>
  make("button", { type: "button", "aria-label": label, title: label, onclick: action, ...attributes }, text);
