// Gamepads: an axis moves a process variable, a button recalls a set, or plays and pauses. Browsers
// show a gamepad to a page once one of its buttons is pressed there; until then nothing is shown.

const POLL_MS = 25;
const POLL_MOST_S = 0.1; // a page that was busy does not catch up
const DEAD_ZONE = 0.1; // a worn stick rests anywhere in it
const SETTLED_MS = 500; // from a request to a state that has its value
const AXES = ["left stick, across", "left stick, down", "right stick, across", "right stick, down"];

// Returns how far an axis is moved, from -1 to 1: 0 in the dead zone, from which it rises without a
// jump. In hundredths, so that a hand that holds still sends nothing.
function deflection(axis) {
  const share = Math.min(Math.max(Math.abs(axis) - DEAD_ZONE, 0) / (1 - DEAD_ZONE), 1);
  return (Math.sign(axis) * Math.round(100 * share)) / 100;
}

// Returns the nearest value that a variable can have, beside an end that is not one.
function withinRange({ min, max, range, default: usual }, value) {
  const beside = 1e-3 * (Math.abs(usual) || 1);
  const low = min === null ? -Infinity : min + (range.startsWith("]") ? beside : 0);
  const high = max === null ? Infinity : max - (range.endsWith("[") ? beside : 0);
  return Math.min(Math.max(value, low), high);
}

// A choice; one that is not among the known, as a set of another folder, stays.
function choice(label, changed) {
  const element = make("select", { "aria-label": label, title: label, onchange: () => changed(element.value) });
  const options = new Keyed(element, ([value]) => value, ([value, text]) => ({ element: make("option", { value }, text) }));
  const set = (chosen, known) => {
    options.set(known.some(([value]) => value === chosen) ? known : [...known, [chosen, chosen]]);
    if (document.activeElement !== element) element.value = chosen;
  };
  return { element, set };
}

// An axis with the variable that it moves. It acts once it was at rest: a trigger that rests at an
// end, and a stick that is held while it is chosen, change nothing.
class Axis {
  constructor(name, kept, keep) {
    const { variable, mode, span } = kept ?? {};
    this.kept = {
      variable: typeof variable === "string" ? variable : "",
      mode: mode === "rate" ? "rate" : "position",
      span: Number.isFinite(span) ? span : null,
    };
    this.sender = new Latest(async (body) => {
      const accepted = await request("set", body);
      if (!accepted && this.kept.mode === "rate") this.value = null;
    });
    const choose = (chosen) => {
      Object.assign(this.kept, chosen);
      this.release();
      this.show();
      keep();
    };
    this.variables = choice(`${name}: process variable`, (chosen) => choose({ variable: chosen, span: null }));
    this.modes = choice(`${name}: how it acts`, (chosen) => choose({ mode: chosen }));
    this.modes.set(this.kept.mode, [["position", "position"], ["rate", "rate"]]);
    const read = () => choose({ span: this.field.value === "" ? null : Number(this.field.value) });
    this.field = make("input", { type: "number", step: "any", "aria-label": `${name}: change at full deflection`, onchange: read });
    this.unit = make("span", { class: "soft" });
    this.inputs = [this.variables.element, this.modes.element, make("span", {}, this.field, this.unit)];
    this.release();
  }

  get variable() {
    return state?.variables.find((it) => it.name === this.kept.variable);
  }

  get span() {
    const { default: usual, min, max } = this.variable ?? {};
    return this.kept.span ?? 0.25 * (Math.abs(usual) || (max - min) / 2 || 1);
  }

  show() {
    this.variables.set(this.kept.variable, [["", "–"], ...(state?.variables ?? []).map(({ name }) => [name, name])]);
    for (const input of this.inputs.slice(1)) input.hidden = !this.kept.variable;
    this.field.value = short(this.span);
    const unit = this.variable?.unit ?? "1";
    write(this.unit, `${unit === "1" ? "" : ` ${unit}`} ${this.kept.mode === "rate" ? "per s" : "to a side"}`);
  }

  // Sends nothing more until the axis was at rest.
  release() {
    [this.isArmed, this.value, this.sentAt, this.sender.value] = [false, null, -Infinity, null];
  }

  follow(axis, at, elapsed) {
    const moved = deflection(axis);
    const { variable } = this;
    if (!variable) return moved.toFixed(2);
    const isRate = this.kept.mode === "rate";
    // What was sent, until the state has it.
    const known = this.value ?? variable.target;
    let wanted = known;
    if (moved === 0) {
      if (this.value !== null && !isRate) wanted = this.centre;
      this.isArmed = true;
    } else if (this.isArmed) {
      wanted = withinRange(variable, isRate ? known + moved * this.span * elapsed : this.centre + moved * this.span);
    }
    if (wanted !== known) {
      [this.value, this.sentAt] = [wanted, at];
      this.sender.put({ variable: variable.name, value: wanted });
    } else if (moved === 0 && at - this.sentAt > SETTLED_MS) {
      // The centre is the value when the variable was chosen, or that of a slider or a set since: a
      // stick that leaves it does not jump back.
      [this.value, this.centre] = [null, variable.target];
    }
    return moved.toFixed(2);
  }
}

class PadButton {
  constructor(name, kept, keep) {
    this.kept = typeof kept === "string" && !(live.hardware && kept === "toggle") ? kept : "";
    this.actions = choice(`${name}: action`, (chosen) => {
      this.kept = chosen;
      keep();
    });
    this.inputs = [this.actions.element];
    this.release();
  }

  show() {
    const sets = (state?.sets ?? []).map((name) => [`recall ${name}`, `recall ${name}`]);
    this.actions.set(this.kept, [["", "–"], ...(live.hardware ? [] : [["toggle", "play, pause"]]), ...sets]);
  }

  // The press that connects a gamepad is none.
  release() {
    this.isDown = true;
  }

  follow({ pressed }) {
    const isNew = pressed && !this.isDown;
    this.isDown = pressed;
    if (isNew && this.kept === "toggle") toggle();
    else if (isNew && this.kept) request("recall", { name: this.kept.replace(/^recall /, "") });
    return pressed ? "pressed" : "";
  }
}

// A gamepad with its mapping, which the browser keeps for a scenario.
class Pad {
  constructor({ id, mapping, axes, buttons }) {
    const key = `gamepad of ${live.title}: ${id}`;
    let kept = null;
    try {
      kept = JSON.parse(localStorage.getItem(key));
    } catch {
      // It begins without a mapping, as it does where the browser keeps none.
    }
    const keep = () => {
      try {
        localStorage.setItem(key, JSON.stringify({ axes: this.axes.map((it) => it.kept), buttons: this.buttons.map((it) => it.kept) }));
      } catch {
        say("The browser does not keep the mapping of the gamepad.", false);
      }
    };
    const nameOf = (i) => (mapping === "standard" && AXES[i]) || `axis ${i}`;
    this.axes = axes.map((_, i) => new Axis(nameOf(i), kept?.axes?.[i], keep));
    this.buttons = buttons.map((_, i) => new PadButton(`button ${i}`, kept?.buttons?.[i], keep));
    this.status = make("span", { class: "soft", role: "status" });
    this.element = make("div", { class: "pad" }, make("h3", {}, `Gamepad ${id} `, this.status));
    const body = table(this.element, ["", "now", "does"], `Mapping of the gamepad ${id}`);
    this.rows = [...this.axes.map((it, i) => [it, nameOf(i)]), ...this.buttons.map((it, i) => [it, `button ${i}`])].map(([control, name]) => {
      const now = make("td");
      const does = make("td", {}, make("div", { class: "line" }, ...control.inputs));
      body.append(make("tr", {}, make("th", { scope: "row" }, name), now, does));
      return { control, now };
    });
    this.show();
  }

  show() {
    for (const { control } of this.rows) control.show();
  }

  follow(found, at, elapsed) {
    write(this.status, found ? "connected" : "not connected: the variables keep their values");
    const inputs = found && [...this.axes.map((_, i) => found.axes[i] ?? 0), ...this.buttons.map((_, i) => found.buttons[i] ?? {})];
    this.rows.forEach(({ control, now }, i) => {
      // Without its gamepad a variable stays as it is: on hardware a jump back, while no hand steers
      // the robot, would be worse.
      if (inputs && connection.isOpen && state) write(now, control.follow(inputs[i], at, elapsed));
      else control.release();
    });
  }
}

class Gamepads {
  constructor(host) {
    host.hidden = true;
    this.host = host;
    this.pads = new Map();
    this.at = 0;
    addEventListener("gamepadconnected", () => setInterval(() => this.#poll(performance.now()), POLL_MS), { once: true });
  }

  // Choices are written anew where they differ: a list that is open stays.
  update({ variables, sets }) {
    const known = JSON.stringify([variables.map((it) => it.name), sets]);
    if (known === this.known) return;
    this.known = known;
    for (const pad of this.pads.values()) pad.show();
  }

  #poll(at) {
    const elapsed = Math.min((at - this.at) / 1000, POLL_MOST_S);
    this.at = at;
    // Browsers do not read gamepads for a page that they hide.
    if (document.hidden) return;
    const connected = [...navigator.getGamepads()].filter((it) => it?.connected);
    const found = new Map(connected.map((it) => [`${it.index} ${it.id}`, it]));
    for (const [key, pad] of found) {
      if (this.pads.has(key)) continue;
      this.pads.set(key, new Pad(pad));
      this.host.append(this.pads.get(key).element);
      this.host.hidden = false;
    }
    for (const [key, pad] of this.pads) pad.follow(found.get(key), at, elapsed);
  }
}
