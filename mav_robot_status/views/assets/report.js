"use strict";
// Data from a log is hostile. It becomes a text node or a number, nothing else.

// Invisible characters and those that change the writing direction are shown as a box.
const UNSEEN = /[\u0000-\u001f\u007f-\u009f\u061c\u200b-\u200f\u2028-\u202e\u2060-\u2069\ufeff]/g;
const clean = (value) => typeof value === "string" ? value.replace(UNSEEN, "\ufffd") : value;

const DATA = JSON.parse(document.getElementById("data").textContent, (_, value) => clean(value));
const SVG = "http://www.w3.org/2000/svg";
const ROW = 24, TOP = 4, BODY = 16; // px: the height of a row, and of the drawing in it
const FINE = 2, CELL = 3; // px: an interval narrower than FINE is drawn together with its neighbours, in cells
const SHORTEST = 1000; // microseconds: the limit of zoom
const STEPS = [1e3, 2e3, 5e3, 1e4, 2e4, 5e4, 1e5, 2e5, 5e5, 1e6, 2e6, 5e6, 1e7, 15e6, 3e7, 6e7, 12e7, 3e8, 6e8, 9e8,
  18e8, 36e8, 72e8, 108e8, 216e8, 432e8, 864e8, 1728e8, 6048e8, 2592e9, 7776e9, 31536e9];
const FIELDS = ["link", "flight_mode", "mode", "armed", "drives_powered", "motion_possible", "in_motion", "e_stopped",
  "in_error"];
for (const name of new Set(DATA.logs.flatMap((log) => log.vehicles.flatMap(({ tracks }) => Object.keys(tracks))))) {
  if (!FIELDS.includes(name)) FIELDS.push(name);
}
// The word, glyph, tone and form of a value, from the one table of them. A name without a row has none.
const lookOf = (track, value) => DATA.looks[track] && DATA.looks[track][value];
const isState = (track) => lookOf(track, "TRUE") !== undefined;
const FORMS = { full: [TOP, BODY], half: [TOP + BODY - 6, 6], line: [TOP + BODY - 3, 3], hatched: [TOP, BODY] };
const KINDS = [["error", "Error causes"], ["inhibit", "Why motion is not possible"], ["unknown", "Why this is unknown"],
  ["not_ready", "Members that could not work"]];
const MORE = 1000; // rows that the table of changes adds at once
const MOST_CYCLES = 50; // arm cycles listed

// -- words -------------------------------------------------------------------------------------------------------------

const two = (n) => String(n).padStart(2, "0");

function duration(us) {
  const s = us / 1e6;
  if (us === 0) return "0 s";
  if (s < 0.1) return `${(s * 1000).toFixed(us < 1e4 ? 1 : 0)} ms`;
  if (s < 60) return `${Math.min(59.9, s).toFixed(1)} s`;
  const whole = Math.round(s), h = Math.floor(whole / 3600), m = Math.floor(whole / 60) % 60;
  return h ? `${h} h ${two(m)} min` : `${m} min ${two(whole % 60)} s`;
}

function utc(us, step) { // time of day
  const at = new Date(Math.floor(us / 1000));
  if (isNaN(at)) return "?";
  const text = at.toISOString().slice(-13, -1); // HH:MM:SS.mmm
  return step === undefined || step < 1e6 ? text : step < 6e7 ? text.slice(0, 8) : text.slice(0, 5);
}

function day(us) {
  const at = new Date(Math.floor(us / 1000));
  return isNaN(at) ? "?" : at.toISOString().slice(0, -14);
}

function elapsed(us, step) {
  const ms = Math.round(us / 1000), s = Math.floor(ms / 1000);
  const whole = `+${Math.floor(s / 3600)}:${two(Math.floor(s / 60) % 60)}:${two(s % 60)}`;
  return step === undefined || step < 1e6 ? `${whole}.${String(ms % 1000).padStart(3, "0")}` : whole;
}

const percent = (part, whole) => {
  const share = whole ? 100 * part / whole : 0;
  return part > 0 && share < 1 ? "< 1 %" : part < whole && share > 99 ? "> 99 %" : `${Math.round(share)} %`;
};

// -- elements ----------------------------------------------------------------------------------------------------------

function make(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children.filter((child) => child !== null));
  return element;
}

function draw(name, attributes, text) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return element;
}

const box = (kind, x, width, y = TOP, height = BODY) =>
  draw("rect", { class: kind, x, y, width: Math.max(0.5, width), height });

const pen = document.createElement("canvas").getContext("2d");
pen.font = "600 11px system-ui, sans-serif";
const widths = new Map();

function widthOf(text) {
  if (!widths.has(text)) widths.set(text, pen.measureText(text).width);
  return widths.get(text);
}

function label(kind, x, width, text, y = 16) { // the text, cut to the width
  const room = width - 9, whole = widthOf(text);
  if (room < 16 || !text) return [];
  const letters = whole <= room ? text.length : Math.floor(text.length * (room - 10) / whole);
  if (letters < 3 && letters < text.length) return [];
  return [draw("text", { class: kind, x: x + 5, y }, letters < text.length ? `${text.slice(0, letters)}…` : text)];
}

// The drawing of a value. Its form says the same as its colour.
function figure(row, span, x, width, right) {
  const from = Math.max(0, x), seen = Math.min(right, x + width) - from, look = row.look(span);
  if (!look) return [box(`name-${span.index % 2}`, x, width), ...label("", from, seen, span.value)];
  const [kind, y] = { full: ["full-text", 16], half: ["", 13], line: ["off-text", 14] }[look.bar] || ["halo", 16];
  return [box(`${look.bar} ${look.tone}`, x, width, ...FORMS[look.bar]),
    ...label(kind, from, seen, row.word(span), y)];
}

// Many short intervals in a few pixels: the height of TRUE is its share of the time.
function texture(row, cell, x, width) {
  const whole = cell.end - cell.start || 1, yes = (cell.TRUE || 0) / whole, unsure = (cell.UNKNOWN || 0) / whole;
  const figures = [box("line calm", x, width, ...FORMS.line)], look = row.look({ value: "TRUE" });
  if (!look) return figures;
  const height = cell.TRUE === undefined ? 0 : Math.max(4, yes * BODY);
  if (height) figures.push(box(`full ${look.tone}`, x, width, TOP + BODY - height, height));
  if (cell.UNKNOWN !== undefined) {
    figures.push(box("hatched unknown", x, width, TOP, Math.max(3, unsure * (BODY - height))));
  }
  return figures;
}

// -- one log -----------------------------------------------------------------------------------------------------------

class Clock { // the clock of a log; where it was set there is a gap between two segments
  constructor(segments) {
    this.segments = segments;
    const length = Math.max(segments.length ? segments[segments.length - 1][1] : 0, SHORTEST);
    this.gap = segments.length > 1 ? Math.round(length * 0.02) : 0;
    this.length = length + this.gap * (segments.length - 1);
  }
  index(at) { // the segment in which an interval begins
    let low = 0, high = this.segments.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.segments[middle][0] <= at) low = middle; else high = middle - 1;
    }
    return low;
  }
  shift(start) { return this.index(start) * this.gap; }
  find(place) { // the segment at a place of the drawing, and the time of the log there; null in a gap
    for (let i = this.segments.length - 1; i >= 0; i--) {
      const at = place - i * this.gap, [start, end] = this.segments[i];
      if (at >= start && (at <= end || i === this.segments.length - 1)) return { i, at };
      if (at >= start) return null;
    }
    return { i: 0, at: 0 };
  }
  unix(place) {
    const found = this.find(place);
    return found && this.segments[found.i][2] + found.at - this.segments[found.i][0];
  }
}

class Log {
  constructor(data) {
    this.data = data;
    this.clock = new Clock(data.segments);
    this.open = this.heard();
    [this.from, this.to] = this.open;
    this.rows = [];
    this.pointers = new Map();
    this.build();
  }

  heard() { // from the first to the last heartbeat with a small margin; the whole log if that is most of it
    const spans = this.data.vehicles.flatMap((v) => this.spans(v.tracks.link)).filter((s) => s.value === "CONNECTED");
    const from = Math.min(...spans.map((s) => s.start)), to = Math.max(...spans.map((s) => s.end));
    const whole = this.clock.length, margin = (to - from) * 0.02;
    if (!spans.length || to - from > 0.9 * whole) return [0, whole];
    return [Math.max(0, from - margin), Math.min(whole, to + margin)];
  }

  string(number) { return this.data.strings[number]; }

  spans(packed) { // four numbers each: gap, length, value or text, evidence
    const spans = [];
    for (let i = 0, at = 0; i < packed.length; i += 4) {
      const start = at + packed[i], [rule, source] = this.string(packed[i + 3]) || [];
      at = start + packed[i + 1];
      const shift = this.clock.shift(start);
      spans.push({ start: start + shift, end: at + shift, value: this.string(packed[i + 2]), rule, source,
        index: spans.length });
    }
    return spans;
  }

  build() {
    const { data, clock } = this, first = clock.segments[0], last = clock.segments[clock.segments.length - 1];
    const count = data.vehicles.length, jumps = clock.segments.length - 1;
    const began = first ? first[2] : 0, ended = last ? last[2] + last[1] - last[0] : 0;
    const about = [`${day(began)} ${utc(began, 1e6)} to `,
      `${day(ended) === day(began) ? "" : `${day(ended)} `}${utc(ended, 1e6)} UTC`,
      `, ${duration(last ? last[1] : 0)}, ${count} ${count === 1 ? "vehicle" : "vehicles"}`,
      jumps ? `, the log's clock was set ${jumps === 1 ? "once" : `${jumps} times`}` : ""].join("");
    this.range = make("output");
    const button = (text, title, act) => {
      const made = make("button", { type: "button", title, "aria-label": title }, text);
      made.addEventListener("click", act);
      return made;
    };
    this.utc = this.plot("Time, UTC");
    this.elapsed = this.plot("Elapsed");
    this.utc.plot.tabIndex = 0;
    this.utc.plot.setAttribute("role", "group");
    this.utc.plot.setAttribute("aria-label",
      "Time axis. Left and right move, plus and minus zoom, 0 shows the whole log");
    this.cross = make("div", { class: "cross" });
    this.thumb = make("i");
    this.chart = make("div", { class: "chart" }, this.utc.element, ...data.vehicles.map((v) => this.vehicle(v)),
      this.elapsed.element, make("div", { class: "where" }, this.thumb), this.cross);
    this.utc.element.classList.add("axis", "utc");
    this.elapsed.element.classList.add("axis", "elapsed");
    this.element = make("section", { class: "log" },
      make("div", { class: "head" }, make("div", {}, make("h2", {}, data.name), make("p", { class: "soft" }, about)),
        make("div", { class: "tools" }, this.range,
          button("−", "Zoom out (-)", () => this.zoom(2)), button("+", "Zoom in (+)", () => this.zoom(0.5)),
          ...(this.isPart ? [button("When heard", "The time in which a vehicle was heard", () => this.show(...this.open))]
            : []),
          button("Whole log", "Whole log (0)", () => this.show(0, clock.length)))),
      count ? this.chart : make("p", {}, "This log has no heartbeat of an autopilot."),
      ...data.vehicles.map((v) => totalsOf(this, v)), count ? new Changes(this).element : null);
    this.listen();
  }

  get isPart() { return this.open[1] - this.open[0] < this.clock.length; }

  plot(text, figures = "") {
    const svg = draw("svg", { height: ROW, "aria-hidden": "true" });
    const plot = make("div", { class: "plot" }, svg);
    const head = make("div", { class: "label" }, make("b", {}, text), make("span", {}, figures));
    return { element: make("div", {}, head, plot), plot, svg };
  }

  vehicle(vehicle) {
    const kind = [vehicle.autopilot, vehicle.type].filter(Boolean).join(", ");
    const { totals } = vehicle;
    const element = make("div", { class: "vehicle" }, make("div", { class: "name" },
      make("h3", {}, `${vehicle.type === "GROUP" ? "Group" : "Vehicle"} ${vehicle.name} `, make("span", { class: "soft" }, kind)),
      make("p", { class: "soft" }, vehicle.handle)));
    const add = (row) => {
      const made = this.plot(row.title || row.id, row.figures);
      Object.assign(row, made, { vehicle, chosen: -1 });
      row.element.classList.add("row");
      row.plot.tabIndex = 0;
      row.plot.setAttribute("role", "group");
      row.plot.setAttribute("aria-roledescription", "timeline");
      row.plot.setAttribute("aria-label", `${row.title || row.id}, vehicle ${vehicle.name}: ${row.figures}, `
        + `${row.spans.length} intervals. Left and right step through them, Enter zooms`);
      this.rows.push(row);
      element.append(row.element);
    };
    let cycle = 0;
    const cycles = totals.arm_cycles.map((c) => c.start + this.clock.shift(c.start));
    for (const id of FIELDS) {
      const spans = this.spans(vehicle.tracks[id]).filter((span) => span.value !== "");
      const look = (span) => lookOf(id, span.value);
      const word = (span) => !look(span) ? span.value
        : `${look(span).glyph} ${look(span).word}${span.cycle && span.value === "TRUE" ? `, cycle ${span.cycle}` : ""}`;
      if (id === "armed") {
        for (const span of spans) {
          if (cycles[cycle] === span.start) cycle++;
          span.cycle = cycle;
        }
      }
      add({ id, look, spans, word, figures: shortly(id, totals) });
    }
    const losses = this.spans(vehicle.tracks.link).filter((span) => span.value === "LOST");
    for (const [kind, heading] of KINDS) {
      const found = [...totals.errors, ...totals.inhibits].filter((total) => total.kind === kind);
      if (found.length) element.append(make("div", { class: "group" }, heading));
      for (const total of found) {
        const spans = this.spans(vehicle[kind === "error" ? "errors" : "inhibits"][total.name]);
        for (const span of spans) Object.assign(span, { text: span.value, value: "TRUE" });
        const title = total.code === null ? total.name : `${total.code} ${total.name}`;
        const looks = { TRUE: { bar: kind === "unknown" ? "hatched" : "full", tone: total.tone, word: "active" },
          UNKNOWN: { bar: "hatched", tone: "unknown", word: "unknown while the link is lost" } };
        add({ id: total.name, title, spans: kind === "unknown" ? spans : throughLosses(spans, losses), reason: true,
          total, look: (span) => looks[span.value], word: (span) => span.lost ? looks.UNKNOWN.word : span.text || "",
          figures: `${total.occurrences} ×, ${duration(total.active)}` });
      }
    }
    this.rows[this.rows.length - 1].element.classList.add("spaced");
    return element;
  }

  // -- drawing

  get width() { return this.utc.plot.clientWidth || 1; }
  x(place) { return (place - this.from) / (this.to - this.from) * this.width; }
  place(x) { return this.from + x / this.width * (this.to - this.from); }

  redraw() {
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => { this.frame = 0; this.redrawNow(); });
  }

  redrawNow() {
    const ticks = this.ticks();
    for (const row of this.rows) this.drawRow(row, ticks);
    this.drawAxis(ticks);
    const whole = this.clock.length;
    this.thumb.style.left = `${100 * this.from / whole}%`;
    this.thumb.style.width = `${100 * (this.to - this.from) / whole}%`;
    const shown = this.to - this.from;
    this.range.textContent = shown >= whole ? "" : `${duration(shown)} of ${duration(whole)}`;
  }

  step() { // the smallest step with room for its labels
    const room = (step) => step < 1e6 ? 100 : step < 6e7 ? 80 : 66;
    return STEPS.find((s) => (this.to - this.from) / s * room(s) <= this.width) || STEPS[STEPS.length - 1];
  }

  ticks() {
    const step = this.step(), found = [];
    for (const [i, [start, end, unix]] of this.clock.segments.entries()) {
      const shift = i * this.clock.gap, offset = unix - start - shift; // UTC = place + offset
      const low = Math.max(this.from, start + shift) + offset, high = Math.min(this.to, end + shift) + offset;
      for (let at = Math.ceil(low / step) * step; at <= high; at += step) found.push({ at, x: this.x(at - offset) });
    }
    return { step, found };
  }

  drawAxis({ step, found }) {
    const figures = [];
    let before = "", right = -Infinity;
    for (const { at, x } of found) {
      figures.push(draw("line", { class: "tick", x1: x, x2: x, y1: 17, y2: ROW }));
      const date = day(at), words = step >= 864e8 || (before && date !== before) ? date : utc(at, step);
      if (x < right || x + widthOf(words) > this.width) continue;
      figures.push(draw("text", { x: x + 2, y: 12 }, words));
      right = x + widthOf(words) + 8;
      before = date;
    }
    for (const x of this.breaks()) figures.push(draw("text", { class: "day", x: x + 2, y: 12 }, "clock set"));
    this.utc.svg.replaceChildren(...figures);
    const other = [];
    const own = this.step();
    for (const [i, [start, end]] of this.clock.segments.entries()) {
      const shift = i * this.clock.gap;
      const low = Math.max(this.from - shift, start), high = Math.min(this.to - shift, end);
      for (let at = Math.ceil(low / own) * own; at <= high; at += own) {
        const x = this.x(at + shift), words = elapsed(at, own);
        other.push(draw("line", { class: "tick", x1: x, x2: x, y1: 0, y2: 6 }));
        if (x + widthOf(words) <= this.width) other.push(draw("text", { x: x + 2, y: 16 }, words));
      }
    }
    this.elapsed.svg.replaceChildren(...other);
  }

  breaks() { // where gaps begin, in pixels
    const segments = this.clock.segments.slice(0, -1), gap = this.clock.gap;
    return segments.map(([, end], i) => this.x(end + i * gap)).filter((x) => x > -100 && x < this.width);
  }

  drawRow(row, { found }) {
    const { width } = this, figures = [];
    for (const { x } of found) figures.push(draw("line", { class: "tick", x1: x, x2: x, y1: 0, y2: ROW }));
    const gap = this.clock.gap / (this.to - this.from) * width;
    for (const x of this.breaks()) figures.push(box("break", x, gap, 0, ROW));
    let cell = null;
    const flush = () => {
      if (cell) {
        const x = this.x(cell.start), wide = this.x(cell.end) - x;
        figures.push(...(cell.only ? this.drawSpan(row, cell.only, x, Math.max(wide, FINE))
          : texture(row, cell, x, Math.max(wide, FINE))));
      }
      cell = null;
    };
    for (let i = firstAfter(row.spans, this.from); i < row.spans.length && row.spans[i].start < this.to; i++) {
      const span = row.spans[i], x = this.x(span.start), wide = this.x(span.end) - x;
      if (wide >= FINE) {
        flush();
        figures.push(...this.drawSpan(row, span, x, wide));
        continue;
      }
      if (cell && (this.x(span.end) - this.x(cell.start) > CELL)) flush();
      cell = cell ? { ...cell, only: null } : { start: span.start, end: span.end, only: span };
      cell.end = span.end;
      cell[span.value] = (cell[span.value] || 0) + span.end - span.start;
    }
    flush();
    const chosen = row.spans[row.chosen];
    if (chosen && document.activeElement === row.plot) {
      const x = this.x(chosen.start), wide = Math.max(4, this.x(chosen.end) - x);
      const from = Math.max(1, x), to = Math.min(width - 1, x + wide);
      if (to > from) figures.push(box("chosen", from, to - from, 1.5, ROW - 3));
    }
    row.svg.replaceChildren(...figures);
  }

  drawSpan(row, span, x, wide) {
    if (x < -20) { wide += x + 20; x = -20; } // patterns far outside the view cost time
    wide = Math.min(wide, this.width + 40 - x);
    const figures = figure(row, span, x, wide, this.width);
    if (row.reason && !span.lost && x >= 0) { // a mark that is visible even for a short cause
      figures.push(draw("path", { class: `mark ${row.total.tone}`, d: `M${Math.max(4, x) - 4} 1h8l-4 7z` }));
    }
    return figures;
  }

  // -- zoom and scroll

  show(from, to) {
    const whole = this.clock.length, length = Math.min(whole, Math.max(SHORTEST, to - from));
    this.from = Math.min(Math.max(0, from + (to - from - length) / 2), whole - length);
    this.to = this.from + length;
    this.redraw();
  }

  zoom(factor, at = (this.from + this.to) / 2) {
    this.show(at - (at - this.from) * factor, at + (this.to - at) * factor);
  }

  pan(share) {
    const by = (this.to - this.from) * share;
    this.show(this.from + by, this.to + by);
  }

  listen() {
    const plots = new Map(this.rows.map((row) => [row.plot, row]));
    const rowAt = (event) => plots.get(event.target.closest && event.target.closest(".plot"));
    const inside = (event) => event.target.closest && event.target.closest(".plot");
    const x = (event) => event.clientX - this.utc.plot.getBoundingClientRect().left;
    this.chart.addEventListener("wheel", (event) => {
      if (!inside(event)) return;
      const across = Math.abs(event.deltaX) > Math.abs(event.deltaY);
      // The wheel scrolls the page. It zooms over the time axis, after a click, and with Ctrl.
      if (!across && !event.ctrlKey && !event.metaKey && !event.target.closest(".axis")
        && !this.chart.contains(document.activeElement)) return;
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      if (across) this.pan(event.deltaX * lines / this.width);
      else this.zoom(Math.exp(Math.max(-240, Math.min(240, event.deltaY * lines)) * 0.003), this.place(x(event)));
    }, { passive: false });
    this.chart.addEventListener("pointerdown", (event) => {
      if (!inside(event) || event.button !== 0) return;
      this.pointers.set(event.pointerId, x(event));
      this.dragged = false;
    });
    this.chart.addEventListener("pointermove", (event) => {
      const row = rowAt(event);
      active = this;
      if (!this.pointers.has(event.pointerId)) {
        if (inside(event)) this.hover(row, x(event)); else this.leave();
        return;
      }
      const before = [...this.pointers.values()], length = this.to - this.from, to = x(event);
      if (!this.dragged && before.length === 1 && Math.abs(to - before[0]) < 3) return;
      if (!this.dragged) this.chart.setPointerCapture(event.pointerId);
      this.dragged = true;
      const other = [...this.pointers].find(([id]) => id !== event.pointerId);
      const was = this.pointers.get(event.pointerId);
      this.pointers.set(event.pointerId, to);
      if (other) { // two fingers: the drawing follows both
        const apart = Math.max(8, Math.abs(was - other[1])), now = Math.max(8, Math.abs(to - other[1]));
        this.zoom(apart / now, this.place(other[1]));
      } else {
        const by = (was - to) / this.width * length;
        this.show(this.from + by, this.to + by);
      }
    });
    for (const name of ["pointerup", "pointercancel"]) {
      this.chart.addEventListener(name, (event) => {
        if (this.pointers.delete(event.pointerId) && !this.dragged && name === "pointerup") {
          const row = rowAt(event);
          if (row) this.choose(row, indexAt(row.spans, this.place(x(event))), false);
          this.hover(row, x(event));
        }
      });
    }
    this.chart.addEventListener("pointerleave", () => this.leave());
    this.chart.addEventListener("dblclick", (event) => {
      const row = rowAt(event), span = row && row.spans[indexAt(row.spans, this.place(x(event)))];
      if (span) this.fit(span);
    });
    this.chart.addEventListener("focusin", (event) => { active = this; this.redraw(); });
    this.chart.addEventListener("focusout", () => this.redraw());
    this.chart.addEventListener("keydown", (event) => {
      const row = plots.get(event.target);
      if (row && !event.ctrlKey && !event.metaKey && !event.altKey && !event.shiftKey && this.rowKey(row, event.key)) {
        event.preventDefault();
        event.stopPropagation();
      }
    });
  }

  rowKey(row, key) { // true if the row handles the key
    const last = row.spans.length - 1, here = this.rows.indexOf(row);
    const step = { ArrowLeft: row.chosen - 1, ArrowRight: row.chosen + 1, Home: 0, End: last }[key];
    if (step !== undefined) {
      const first = Math.max(0, indexAfter(row.spans, this.from));
      this.choose(row, row.chosen < 0 ? first : Math.min(last, Math.max(0, step)));
    } else if (key === "ArrowUp" || key === "ArrowDown") {
      const next = this.rows[here + (key === "ArrowUp" ? -1 : 1)];
      if (!next) return false;
      const span = row.spans[row.chosen];
      next.plot.focus();
      if (span) this.choose(next, indexAt(next.spans, Math.max(span.start, this.from)));
    } else if (key === "Enter" && row.spans[row.chosen]) {
      this.fit(row.spans[row.chosen]);
    } else if (key === "Escape") {
      row.plot.blur();
    } else return false;
    return true;
  }

  fit(span) {
    const around = (span.end - span.start) * 0.1 || SHORTEST;
    this.show(span.start - around, span.end + around);
  }

  choose(row, index, spoken = true) {
    row.chosen = index;
    const span = row.spans[index];
    if (!span) return;
    const length = this.to - this.from;
    if (span.end <= this.from || span.start >= this.to) this.show(span.start - length / 2, span.start + length / 2);
    this.redraw();
    if (!spoken) return;
    this.inspect(row, span, Math.min(Math.max(span.start, this.from), span.end));
    document.getElementById("live").textContent = this.describe(row, span).join(". ");
  }

  // -- the inspector

  hover(row, x) {
    const place = this.place(Math.min(Math.max(0, x), this.width));
    this.cross.style.display = "block";
    this.cross.style.left = `${this.utc.plot.offsetLeft + x}px`;
    this.inspect(row, row && row.spans[indexAt(row.spans, place, FINE / this.width * (this.to - this.from))], place);
  }

  leave() { this.cross.style.display = "none"; }

  inspect(row, span, place) {
    const at = this.clock.find(place), unix = this.clock.unix(place);
    const time = at ? [make("b", {}, utc(unix)), ` UTC, ${elapsed(at.at)}`] : [make("b", {}, "the log's clock was set")];
    const words = !row ? [] : span ? this.describe(row, span) : [`${row.title || row.id}: not active here`];
    const panel = document.getElementById("inspector");
    panel.replaceChildren(make("p", {}, ...time), make("div", {},
      make("p", {}, make("b", {}, words[0] || "")), make("p", { class: "text soft" }, words.slice(1).join("   "))));
    panel.classList.add("shown");
  }

  describe(row, span) { // value, time, evidence
    const name = row.title || row.id, many = this.data.vehicles.length > 1 ? `vehicle ${row.vehicle.name}, ` : "";
    const look = row.look(span), state = !look ? span.value : row.reason ? look.word : row.word(span);
    const from = this.clock.unix(span.start), lasted = duration(span.end - span.start);
    const words = [`${many}${name}: ${state}, ${lasted}, ${utc(from)} to ${utc(from + span.end - span.start)}`];
    if (span.text) words.push(`“${span.text}”`);
    if (row.reason && !span.lost) words.push(row.total.sentence, ...row.total.steps);
    if (span.rule) words.push(span.rule);
    if (span.source) words.push(`[${span.source}]`);
    return words;
  }
}

// A lost link does not end a reason: nobody knows whether it goes on.
function throughLosses(spans, losses) {
  const ends = new Set(spans.map((span) => span.end));
  const unsure = losses.filter((loss) => ends.has(loss.start)).map(({ start, end }) =>
    ({ start, end, value: "UNKNOWN", lost: true }));
  return [...spans, ...unsure].sort((a, b) => a.start - b.start).map((span, index) => Object.assign(span, { index }));
}

function firstAfter(spans, place) { // the first span that ends after the place
  let low = 0, high = spans.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (spans[middle].end > place) high = middle; else low = middle + 1;
  }
  return low;
}

function indexAfter(spans, place) { return Math.min(spans.length - 1, firstAfter(spans, place)); }

function indexAt(spans, place, near = 0) {
  const i = firstAfter(spans, place - near);
  return i < spans.length && spans[i].start <= place + near ? i : -1;
}

// -- tables ------------------------------------------------------------------------------------------------------------

function shortly(id, { watched, linked, values, linked_values: inLink, arm_cycles: cycles }) {
  const lasted = inLink[id];
  if (id === "armed") return `${cycles.length} ×, ${duration(lasted.TRUE || 0)}`;
  if (id === "link") return `${lookOf(id, "CONNECTED").word} ${percent(values.link.CONNECTED || 0, watched)}`;
  if (id === "flight_mode") return "";
  const value = isState(id) ? "TRUE" : "AUTO";
  return `${lookOf(id, value).word} ${percent(lasted[value] || 0, linked)}`;
}

function table(caption, heads, rows) {
  const cell = (name, head, text) => {
    const kind = !head.startsWith("#") ? "text" : text === "0 s" ? "number zero" : "number";
    return make(name, { class: kind, ...(name === "th" ? { scope: "col" } : {}) }, ...[text].flat());
  };
  return make("div", { class: "wide" }, make("table", {}, make("caption", {}, caption),
    make("thead", {}, make("tr", {}, ...heads.map((head) => cell("th", head, head.replace("#", ""))))),
    make("tbody", {}, ...rows.map((row) => make("tr", {}, make("th", { scope: "row" }, row[0]),
      ...row.slice(1).map((text, i) => cell("td", heads[i + 1], text)))))));
}

function totalsOf(log, vehicle) {
  const { totals } = vehicle, { watched, linked, values, linked_values: inLink } = totals;
  const share = (us, whole) => us ? [duration(us), make("span", { class: "share" }, percent(us, whole))] : ["0 s"];
  const time = (at) => utc(log.clock.unix(at + log.clock.shift(at)), 1e6);
  const state = (name, value) => {
    const { glyph, word } = lookOf(name, value);
    return [make("span", { class: "said" }, `${glyph} ${word}`), ...share(inLink[name][value] || 0, linked)];
  };
  const named = (name, value, whole, from) => {
    const { glyph, word } = lookOf(name, value);
    return [`${name}: ${glyph} ${word}`, share(from[name][value] || 0, whole)];
  };
  const parts = [
    table(`Time in each state, of ${duration(linked)} with a link`, ["field", "#yes", "#no", "#unknown"],
      FIELDS.filter(isState).map((name) => [name, ...["TRUE", "FALSE", "UNKNOWN"].map((value) => state(name, value))])),
    table("Time in each mode, with a link", ["mode", "#time"], [
      ...Object.keys(DATA.looks.mode).map((value) => named("mode", value, linked, inLink)),
      ...Object.keys(inLink.flight_mode).filter(Boolean).map((mode) =>
        [`flight_mode: ${clean(mode)}`, share(inLink.flight_mode[mode], linked)])]),
    table(`The link, of ${duration(watched)} since the first heartbeat`, ["link", "#time"],
      Object.keys(DATA.looks.link).map((value) => named("link", value, watched, values))),
  ];
  if (totals.arm_cycles.length) {
    const count = totals.arm_cycles.length;
    const first = count > MOST_CYCLES ? `, the first ${MOST_CYCLES} of ${count}` : "";
    const cycles = totals.arm_cycles.slice(0, MOST_CYCLES);
    parts.push(table(`Arm cycles${first}`, ["cycle", "#from", "#to", "#armed"], cycles.map((c, i) =>
      [String(i + 1), time(c.start), utc(log.clock.unix(c.start + log.clock.shift(c.start)) + c.end - c.start, 1e6),
        duration(c.armed)])));
  }
  for (const [kind, caption] of KINDS) {
    const found = [...totals.errors, ...totals.inhibits].filter((total) => total.kind === kind);
    if (!found.length) continue;
    parts.push(table(caption, ["name", "#times", "#time", "what it is, and the first step"], found.map((t) =>
      [t.code === null ? t.name : `${t.code} ${t.name}`, String(t.occurrences), duration(t.active),
        [t.sentence, ...t.texts.map((text) => `“${text}”`), ...t.steps].map((one) => make("div", {}, one))])));
  }
  return make("div", {}, make("h3", { class: "over" }, `Totals, vehicle ${vehicle.name}`),
    make("div", { class: "totals" }, ...parts));
}

class Changes { // every change as text, for search and for screen readers
  constructor(log) {
    this.log = log;
    this.rows = log.rows.flatMap((row) => row.spans.flatMap((span, i) => this.ofSpan(row, span, row.spans[i - 1])));
    this.rows.sort((a, b) => a[0] - b[0]);
    this.body = make("tbody");
    this.more = make("button", { type: "button" });
    this.more.addEventListener("click", () => this.add());
    const heads = ["UTC", "elapsed", ...(this.many ? ["vehicle"] : []), "what", "why"];
    this.element = make("details", {}, make("summary", {}, `Every change as text (${this.rows.length})`),
      make("table", {}, make("thead", {}, make("tr", {}, ...heads.map((head) => make("th", { scope: "col" }, head)))),
        this.body), this.more);
    this.add();
  }
  get many() { return this.log.data.vehicles.length > 1; }
  ofSpan(row, span, before) {
    const name = row.title || row.id;
    const why = span.text ? `“${span.text}”` : [span.rule, span.source && `[${span.source}]`].filter(Boolean).join("  ");
    if (!row.reason) {
      return [[span.start, row, `${name}: ${before ? `${row.word(before)} → ` : ""}${row.word(span)}`, why]];
    }
    if (span.lost) {
      const after = row.spans[span.index + 1], unsure = [span.start, row, `${name}: ${row.look(span).word}`, ""];
      return after && after.start === span.end ? [unsure]
        : [unsure, [span.end, row, `${name}: not reported since the link is back`, ""]];
    }
    const goesOn = before && before.end === span.start;
    const next = row.spans[span.index + 1];
    const begins = [span.start, row, goesOn ? `${name} ${before.lost ? "is reported again" : "continues with another text"}` : `${name} begins`, why];
    return next && next.start === span.end ? [begins] : [begins, [span.end, row, `${name} ends`, ""]];
  }
  add() {
    const { clock } = this.log, made = document.createDocumentFragment();
    for (const [place, row, what, why] of this.rows.splice(0, MORE)) {
      const found = clock.find(place);
      made.append(make("tr", {}, make("td", {}, found ? `${day(clock.unix(place))} ${utc(clock.unix(place))}` : ""),
        make("td", {}, found ? elapsed(found.at) : ""), this.many ? make("td", {}, row.vehicle.name) : null,
        make("td", { class: "text" }, what), make("td", { class: "text" }, why)));
    }
    this.body.append(made);
    this.more.hidden = !this.rows.length;
    this.more.textContent = `Show ${Math.min(MORE, this.rows.length)} more of ${this.rows.length}`;
  }
}

// -- the page ----------------------------------------------------------------------------------------------------------

const main = document.getElementById("main");
const logs = DATA.logs.map((data) => new Log(data));
let active = logs[0];
main.append(...logs.map((log) => log.element));

for (const name of FIELDS.filter((field) => DATA.looks[field])) {
  const values = Object.entries(DATA.looks[name]).map(([value, { word, glyph, bar, tone }]) => {
    const svg = draw("svg", { width: 22, height: ROW, "aria-hidden": "true" });
    svg.append(box(`${bar} ${tone}`, 1, 20, ...FORMS[bar]));
    return make("span", { class: "look", "data-value": value }, svg, `${glyph} ${word}`);
  });
  document.getElementById("legend").append(make("li", { "data-field": name }, make("b", {}, name), ...values));
}
const keys = [["wheel on the axis or Ctrl+wheel", "zoom"], ["drag", "move"], ["double click", "zoom to an interval"],
  ["+ − 0", "zoom, whole log"], ["← →", "move, or step through a focused row"]];
document.getElementById("footer").append(make("p", { class: "help" },
  ...keys.flatMap(([key, does]) => [make("kbd", {}, key), ` ${does}   `])), make("p", {}, `Made by ${DATA.by}. `
  + "Percentages count only time with a link, that of the link all time. Unknown is not no: it may move. The status is information, not a safety function."));

document.addEventListener("keydown", (event) => {
  if (!active || event.ctrlKey || event.metaKey || event.altKey || event.target.closest("button, summary, a")) return;
  const closer = () => active.zoom(0.5), farther = () => active.zoom(2);
  const acts = { "+": closer, "=": closer, "-": farther, _: farther, 0: () => active.show(0, active.clock.length), ArrowLeft: () => active.pan(-0.2), ArrowRight: () => active.pan(0.2) };
  if (!acts[event.key]) return;
  event.preventDefault();
  acts[event.key]();
});

const resized = new ResizeObserver(() => logs.forEach((log) => log.redraw()));
logs.forEach((log) => { resized.observe(log.utc.plot); log.redrawNow(); });
matchMedia("print").addEventListener("change", () => logs.forEach((log) => log.redrawNow()));
const views = new Map();
addEventListener("beforeprint", () => { // print what the page opened on
  for (const log of logs) {
    views.set(log, [log.from, log.to]);
    [log.from, log.to] = log.open;
    log.redrawNow();
  }
});
addEventListener("afterprint", () => views.forEach(([from, to], log) => log.show(from, to)));
