// Data of the page: unpacking, and columns of numbers as arrays.

// Returns the bytes of an element; none without it, as on the page of a live run.
async function unpacked(id) {
  const text = document.getElementById(id)?.textContent;
  if (text === undefined) return null;
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const planes = await unpacked("run-columns");
const unpackedData = await unpacked("run-data");
const data = unpackedData ? JSON.parse(new TextDecoder().decode(unpackedData)) : { runs: [] };

const arrays = new WeakMap();

// Returns the numbers of a column, decoded once. A gap is null, as the plots want it. Columns of a
// live run are arrays.
function numbers(column) {
  if (Array.isArray(column)) return column;
  if (!arrays.has(column)) arrays.set(column, decoded(column));
  return arrays.get(column);
}

function decoded(column) {
  const { n } = column;
  if (!("at" in column)) return new Array(n).fill(column.c);
  const { at, lo, step, bytes } = column;
  const gap = 256 ** bytes - 1;
  const values = new Array(n);
  let code = 0;
  for (let i = 0; i < n; i += 1) {
    let difference = 0;
    for (let plane = bytes - 1; plane >= 0; plane -= 1) {
      difference = difference * 256 + planes[at + plane * n + i];
    }
    code = (code + difference) % (gap + 1);
    values[i] = code === gap ? null : lo + code * step;
  }
  return values;
}

// Returns the index of the last of rising `times` that is not above `t`; 0 before the first.
function indexAt(times, t) {
  let [low, high] = [0, times.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle - 1;
  }
  return low;
}

// Text of a number with its unit: angles in degrees, small lengths and times with a prefix.
function quantity(value, unit) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  const digits = (number) => (number === 0 ? "0" : String(Number(number.toPrecision(4))));
  if (unit === "rad") return `${digits((value * 180) / Math.PI)}°`;
  if (unit === "1" || unit === "") return digits(value);
  if (["m", "s", "J", "N·s"].includes(unit) && size > 0 && size < 0.1) {
    return size < 1e-4 ? `${digits(value * 1e6)} µ${unit}` : `${digits(value * 1e3)} m${unit}`;
  }
  return `${digits(value)} ${unit}`;
}

// Creates an element with attributes, properties of events ("onclick") and children.
function make(name, attributes = {}, ...children) {
  const [space, tag] = name.includes(":") ? name.split(":") : ["", name];
  const element = space
    ? document.createElementNS("http://www.w3.org/2000/svg", tag)
    : document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (value !== null && value !== undefined && value !== false) {
      element.setAttribute(key, value === true ? "" : value);
    }
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

// Colours of the style sheet, read once for each scheme.
const colours = new Map();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => colours.clear());

function colour(name) {
  if (!colours.has(name)) {
    const value = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    colours.set(name, value);
  }
  return colours.get(name);
}

// Fits a canvas to its element on the screen; returns its context and size, or nothing if it is
// not shown.
function fitted(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (width === 0) return null;
  const [across, down] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== across || canvas.height !== down) {
    canvas.width = across;
    canvas.height = down;
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}
