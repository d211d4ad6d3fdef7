// One slider for each process variable, saved sets of their values, and the limit of their rate.

const SEARCH_FROM = 12;

// Returns the limits of a slider. An unbounded side ends at 0 or at twice the default, and behind
// each value that is set.
function limitsOf({ min, max, default: usual, target }) {
  const size = 2 * Math.abs(usual) || 1;
  const low = min ?? Math.min(usual < 0 || usual === 0 ? -size : 0, target);
  const high = max ?? Math.max(usual < 0 ? 0 : size, target);
  return [low, Math.max(high, low + 1e-9)];
}

// Returns a step that gives round numbers, and at least 200 positions.
const stepOf = ([low, high]) => 10 ** Math.floor(Math.log10((high - low) / 200));

function variableRow(first) {
  const { name, unit, default: usual } = first;
  const id = `variable-${name}`;
  let isDragged = false;
  const sender = new Latest(async (value) => {
    const accepted = await request("set", { variable: name, value });
    for (const input of [slider, field]) input.setAttribute("aria-invalid", String(!accepted));
    if (!accepted && state) update(state.variables.find((it) => it.name === name) ?? first);
  });
  const slider = make("input", {
    type: "range",
    id,
    oninput: () => {
      isDragged = true;
      field.value = short(Number(slider.value));
      sender.put(Number(slider.value));
    },
    onchange: () => (isDragged = false),
  });
  const field = make("input", {
    type: "number",
    step: "any",
    "aria-label": `${name}, number`,
    onchange: () => (field.value === "" ? (field.value = short(known.target)) : sender.put(Number(field.value))),
  });
  const reset = button("↺", `Reset ${name} to ${withUnit(usual, unit)}`, () => sender.put(usual));
  const usualMark = make("span", { class: "default", title: `default ${withUnit(usual, unit)}` }, "▲");
  const actualMark = make("span", { class: "actual" });
  const actual = make("span", { class: "soft" });
  const element = make(
    "div",
    { class: "variable" },
    make(
      "div",
      { class: "head" },
      make("label", { for: id }, name),
      make("span", { class: "soft range" }, actual, ` ${first.range.replace(/\d+\.\d+/g, (digits) => short(Number(digits)))}${unit === "1" ? "" : ` ${unit}`}`),
    ),
    make("div", { class: "track" }, slider, make("div", { class: "marks", "aria-hidden": "true" }, usualMark, actualMark)),
    field,
    reset,
  );
  let known = first;
  const update = (variable) => {
    known = variable;
    const { value, target } = variable;
    const limits = limitsOf(variable);
    const place = (mark, at) => (mark.style.left = `${(100 * (at - limits[0])) / (limits[1] - limits[0])}%`);
    // Limits stay while the slider is dragged; else it would move under the pointer.
    if (!isDragged && !sender.isBusy) {
      [slider.min, slider.max] = limits;
      slider.step = stepOf(limits);
      slider.value = target;
      if (document.activeElement !== field) field.value = short(target);
    }
    slider.setAttribute("aria-valuetext", withUnit(Number(slider.value), unit));
    place(usualMark, usual);
    place(actualMark, value);
    actualMark.hidden = value === target;
    write(actual, value === target ? "" : `now ${withUnit(value, unit)},`);
    reset.disabled = target === usual;
  };
  return { element, update };
}

class Variables {
  constructor(host) {
    this.none = make("p", { class: "soft" }, "This run has no process variables.");
    this.search = make("input", {
      type: "search",
      placeholder: "find a variable",
      "aria-label": "Find a process variable",
      oninput: () => this.#filter(),
    });
    this.list = make("div", { class: "variables" });
    this.rows = new Keyed(this.list, (it) => it.name, variableRow);
    host.append(this.none, this.search, this.list);
  }

  update({ variables }) {
    this.none.hidden = variables.length > 0;
    this.search.hidden = variables.length <= SEARCH_FROM;
    this.list.classList.toggle("many", !this.search.hidden);
    this.rows.set(variables);
    this.#filter();
  }

  #filter() {
    const words = this.search.value.toLowerCase().split(/\s+/);
    for (const [name, { element }] of this.rows.shown) {
      element.hidden = !this.search.hidden && !words.every((word) => name.toLowerCase().includes(word));
    }
  }
}

// Values that are saved under a name, and how fast recalled and set values are approached.
class Sets {
  constructor(host) {
    const name = make("input", { type: "text", placeholder: "name", "aria-label": "Name of the set to save", required: true });
    const save = async (event) => {
      event.preventDefault();
      if (await request("save", { name: name.value.trim() })) name.value = "";
    };
    const saved = make("span", { class: "chips" });
    this.rows = new Keyed(saved, (it) => it, (set) => ({
      element: button(set, `Recall the set ${set}`, () => request("recall", { name: set })),
    }));
    this.none = make("span", { class: "soft" }, "none is saved");
    this.slew = make("input", {
      type: "number",
      min: 0,
      step: "any",
      id: "slew",
      onchange: () => request("slew", { rate: Math.max(Number(this.slew.value), 0) }),
    });
    host.append(
      make("form", { class: "line", onsubmit: save }, "Save the values as", name, make("button", { type: "submit" }, "save")),
      make("div", { class: "line", role: "group", "aria-label": "Saved sets" }, "Recall", saved, this.none),
      make("div", { class: "line" }, make("label", { for: "slew" }, "Rate limit"), this.slew, "default values per second; 0: none"),
    );
  }

  update({ sets, slew }) {
    this.rows.set(sets);
    this.none.hidden = sets.length > 0;
    if (document.activeElement !== this.slew) this.slew.value = short(slew);
  }
}
