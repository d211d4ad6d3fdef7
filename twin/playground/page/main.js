// The page around the module: an editor with its mistakes, one run at a time, and the page of the
// last run in a frame. Behind module.js and worker.js, which are texts here, for the worker.

const byId = (id) => document.getElementById(id);
const scenarios = JSON.parse(byId("scenarios").textContent);
const text = byId("text");
const CHECK_AFTER_MS = 300;

// Returns the bytes of an element: Base64, deflated.
async function unpacked(id) {
  const packed = Uint8Array.from(atob(byId(id).textContent), (letter) => letter.charCodeAt(0));
  byId(id).remove();
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

const bytes = await unpacked("module");
const code = URL.createObjectURL(new Blob([await unpacked("worker")], { type: "text/javascript" }));

// A worker with the module; `stop` ends it in the middle of a run, and begins a new one.
class Rig {
  constructor() {
    this.asked = new Map();
    this.next = 0;
    this.#begin();
  }

  #begin() {
    this.worker = new Worker(code);
    this.worker.onmessage = ({ data }) => {
      const asked = this.asked.get(data.number);
      if (!data.answer) return asked?.progress(data.share);
      this.asked.delete(data.number);
      asked?.resolve(data);
    };
    this.worker.postMessage({ bytes });
  }

  ask(request, progress = () => {}) {
    const number = (this.next += 1);
    return new Promise((resolve) => {
      this.asked.set(number, { resolve, progress });
      this.worker.postMessage({ number, request });
    });
  }

  stop() {
    this.worker.terminate();
    for (const { resolve } of this.asked.values()) resolve({ stopped: true });
    this.asked.clear();
    this.#begin();
  }
}

// Mistakes are found beside a run, in another worker.
const rig = new Rig();
const checker = new Rig();

const file = () => `${byId("scenario").value}.toml`;
const request = (wanted) => ({ file: file(), text: text.value, wanted });

// The mistake with its place, in the editor and below it. The place is the first of the message.
function showMistake(error) {
  const place = error?.match(/--> [^\n]*:(\d+):(\d+)/);
  const line = place ? Number(place[1]) : 0;
  byId("mistake").hidden = !error;
  byId("mistake").querySelector("pre").textContent = error ?? "";
  byId("place").hidden = !place;
  byId("place").textContent = `go to line ${line}`;
  byId("place").onclick = () => goTo(line, Number(place[2]));
  text.setAttribute("aria-invalid", String(Boolean(error)));
  const count = text.value.split("\n").length;
  byId("lines").replaceChildren(
    ...Array.from({ length: count }, (_, i) => {
      if (i + 1 !== line) return `${i + 1}\n`;
      const wrong = document.createElement("span");
      wrong.className = "wrong";
      wrong.textContent = String(i + 1);
      return wrong;
    }),
  );
  byId("lines").scrollTop = text.scrollTop;
}

// Puts the cursor to a line and a column, both from 1, and shows them.
function goTo(line, column) {
  const before = text.value.split("\n").slice(0, line - 1);
  const at = before.reduce((sum, it) => sum + it.length + 1, column - 1);
  text.focus();
  text.setSelectionRange(at, at);
  const height = text.scrollHeight / text.value.split("\n").length;
  text.scrollTop = Math.max((line - 5) * height, 0);
}

// Checks the text; a later check replaces one that has no answer yet.
let checks = 0;
async function check() {
  const number = (checks += 1);
  const { answer } = await checker.ask(request("check"));
  if (number === checks) showMistake(answer.error);
}

// Changed scenarios, by name, outlast the page where the browser keeps them.
const KEPT = "twinrig scenarios";
const changed = kept();

function kept() {
  try {
    return new Map(Object.entries(JSON.parse(localStorage.getItem(KEPT)) ?? {}));
  } catch {
    return new Map();
  }
}

function keep() {
  try {
    localStorage.setItem(KEPT, JSON.stringify(Object.fromEntries(changed)));
  } catch {
    // Nothing is kept: the browser is set so, or has no room.
  }
}

const shipped = (name) => scenarios.find((it) => it.name === name).text;

let pending = null;
function edited() {
  const name = byId("scenario").value;
  const isChanged = text.value !== shipped(name);
  if (isChanged) changed.set(name, text.value);
  else changed.delete(name);
  byId("reset").disabled = !isChanged;
  keep();
  showMistake(null);
  saveAs(byId("save"), text.value, "application/toml", file());
  clearTimeout(pending);
  pending = setTimeout(check, CHECK_AFTER_MS);
}

// Lets a link save a text under a name.
function saveAs(link, content, type, name) {
  URL.revokeObjectURL(link.href);
  link.href = URL.createObjectURL(new Blob([content], { type }));
  link.download = name;
  return link.href;
}

function choose(name) {
  byId("scenario").value = name;
  text.value = changed.get(name) ?? shipped(name);
  text.scrollTop = 0;
  edited();
}

let isRunning = false;
async function run() {
  if (isRunning) return;
  isRunning = true;
  byId("run").disabled = true;
  byId("stop").disabled = false;
  byId("status").textContent = "running";
  byId("progress").value = 0;
  const name = byId("scenario").value;
  const done = await rig.ask(request("page"), (share) => (byId("progress").value = share));
  isRunning = false;
  byId("run").disabled = false;
  byId("stop").disabled = true;
  if (done.stopped) byId("status").textContent = "stopped";
  else show(name, done);
}

function show(name, { answer, wall_s: wall }) {
  const { report, error, page, left_out: leftOut } = answer;
  byId("progress").value = 1;
  byId("result").replaceChildren();
  byId("page").hidden = byId("save-page").hidden = !page;
  if (error) {
    byId("status").textContent = "not run: the scenario has a mistake";
    showMistake(error);
    text.focus();
    return;
  }
  const simulated = report.simulated_s ?? 0;
  byId("status").textContent = `${simulated} s simulated and shown after ${wall.toFixed(1)} s`;
  const rows = [
    ["verdict", report.verdict, report.verdict],
    ["fingerprint", report.fingerprint, "fingerprint"],
    ...(leftOut ? [["not run", leftOut, ""]] : []),
    ...(report.error ? [["ended by", report.error, "error"]] : []),
  ];
  byId("result").replaceChildren(
    ...rows.map(([term, value, kind]) => {
      const row = document.createElement("div");
      const [dt, dd] = [document.createElement("dt"), document.createElement("dd")];
      [dt.textContent, dd.textContent, dd.className] = [term, value ?? "none", kind];
      row.append(dt, dd);
      return row;
    }),
  );
  if (page) byId("page").src = saveAs(byId("save-page"), page, "text/html", `${name}.html`);
}

byId("scenario").replaceChildren(...scenarios.map(({ name }) => new Option(name, name)));
byId("scenario").onchange = () => choose(byId("scenario").value);
byId("run").onclick = run;
byId("reset").onclick = () => {
  changed.delete(byId("scenario").value);
  choose(byId("scenario").value);
};
byId("stop").onclick = () => rig.stop();
text.oninput = edited;
text.onscroll = () => (byId("lines").scrollTop = text.scrollTop);
document.addEventListener("keydown", (event) => {
  if (event.key !== "Enter" || !(event.ctrlKey || event.metaKey)) return;
  event.preventDefault();
  run();
});

const wanted = decodeURIComponent(location.hash.slice(1));
choose(scenarios.some(({ name }) => name === wanted) ? wanted : "trot");
byId("status").textContent = "";
document.documentElement.dataset.ready = "true";
