// The time that everything on the page shows, of the first run; the second is aligned with it.

class Clock {
  constructor(start, end, events) {
    this.start = start;
    this.end = end;
    this.events = events;
    this.now = 0;
    this.speed = 1;
    this.listeners = [];
    this.frame = null;
  }

  listen(listener) {
    this.listeners.push(listener);
    listener(this.now);
  }

  set(t) {
    this.now = Math.min(Math.max(t, this.start), this.end);
    for (const listener of this.listeners) listener(this.now);
  }

  get isPlaying() {
    return this.frame !== null;
  }

  play() {
    if (this.isPlaying) return;
    if (this.now >= this.end) this.set(this.start);
    let last = performance.now();
    const next = (at) => {
      this.frame = requestAnimationFrame(next);
      const t = this.now + ((at - last) / 1000) * this.speed;
      last = at;
      if (t >= this.end) this.pause();
      this.set(t);
    };
    this.frame = requestAnimationFrame(next);
    this.set(this.now);
  }

  pause() {
    if (!this.isPlaying) return;
    cancelAnimationFrame(this.frame);
    this.frame = null;
    this.set(this.now);
  }

  toggle() {
    if (this.isPlaying) this.pause();
    else this.play();
  }

  // Goes to the next event in a direction; to the end of the run behind the last.
  step(direction) {
    this.pause();
    const apart = 1e-6;
    const next =
      direction > 0
        ? this.events.find((event) => event.at > this.now + apart)
        : this.events.findLast((event) => event.at < this.now - apart);
    if (next) this.set(next.at);
    else this.set(direction > 0 ? this.end : this.start);
    return next ?? null;
  }
}

// Returns the time of run `index` that corresponds to `t` of the first.
function aligned(index, t) {
  const knots = data.pair?.knots ?? [];
  if (index === 0 || knots.length === 0) return t;
  const [first, last] = [knots[0], knots[knots.length - 1]];
  if (t <= first[0]) return t + first[1] - first[0];
  if (t >= last[0]) return t + last[1] - last[0];
  const i = indexAt(knots.map((knot) => knot[0]), t);
  const [[a, b], [c, d]] = [knots[i], knots[i + 1]];
  return b + ((t - a) * (d - b)) / (c - a);
}

// Returns the time of the first run that corresponds to `t` of run `index`.
function unaligned(index, t) {
  const knots = data.pair?.knots ?? [];
  if (index === 0 || knots.length === 0) return t;
  const [first, last] = [knots[0], knots[knots.length - 1]];
  if (t <= first[1]) return t - first[1] + first[0];
  if (t >= last[1]) return t - last[1] + last[0];
  const i = indexAt(knots.map((knot) => knot[1]), t);
  const [[a, b], [c, d]] = [knots[i], knots[i + 1]];
  return a + ((t - b) * (c - a)) / (d - b);
}

// Events of all runs at the times of the first: touch-downs, faults, changes, violations, the end.
const events = data.runs
  .flatMap((run, index) =>
    run.incidents.map((incident) => ({
      ...incident,
      run: index,
      own: incident.at,
      at: unaligned(index, incident.at),
    })),
  )
  .sort((a, b) => a.at - b.at);
const ends = data.runs.map((run, index) => [unaligned(index, 0), unaligned(index, run.end)]);
const clock = new Clock(Math.min(...ends.map(([from]) => from)), Math.max(...ends.map(([, to]) => to)), events);

// Text of an instant, in the times of both runs.
function instantText(t) {
  const own = `${t.toFixed(3)} s`;
  return data.runs.length > 1 ? `A ${own} · B ${aligned(1, t).toFixed(3)} s` : own;
}
