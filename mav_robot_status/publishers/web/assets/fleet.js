// The table of robots, one line each, and that of the members of a group. Rows and cells are updated in place: a row keeps
// the keyboard focus, and only what changes is drawn.

import { ago, FIELDS, LINK, looks, plain } from "./words.js";
import { chip, make, setText, told, turn } from "./make.js";
import { ids, kind, members, title } from "./robot.js";

const HELD = 2; // s after a movement of the pointer over the table during which no row changes its place
const URGENT = 5; // a robot whose rank is below this comes to its place at once, any other with the next order
const UNSEEN = 1; // s after which rows outside the window are drawn again
const FIELD_COLUMNS = FIELDS.map((field) => ({ head: field.head, field, of: (robot) => place(field, robot.value(field.name)) }));
const COLUMNS = [
  { head: "State", of: (robot) => robot.headline().rank },
  { head: "Robot", of: () => 0 },
  { head: "Why" },
  ...FIELD_COLUMNS,
  { head: LINK.head, of: (robot) => -place(LINK, robot.line.link?.state) },
];

const NAMES = new Intl.Collator("en", { numeric: true });
const moves = ({ line }) => line.motion_possible === true || line.in_motion === true;
const FILTERS = [
  { name: "All", tone: "calm", has: () => true },
  { name: "In error", tone: "alarm", has: (robot) => robot.value("in_error") === true },
  { name: "E-stopped", tone: "alarm", has: (robot) => robot.value("e_stopped") === true },
  { name: "Not heard", tone: "warning", has: (robot) => !robot.heard() },
  { name: "Can move", tone: "active", has: (robot) => robot.heard() && moves(robot) },
];

/** The place of a value in the table of looks. */
function place(field, value) {
  const found = [...field.looks.keys()].indexOf(value ?? null);
  return found < 0 ? field.looks.size : found;
}

/** Sorted by a column, then by name. A group stands where its first member or the group itself would be, with its members below it. */
export function sorted(robots, column = COLUMNS[0], down = false) {
  const keys = new Map(robots.map((robot) => [robot, column.of(robot)]));
  const byHandle = new Map(robots.map((robot) => [robot.line.handle, robot]));
  const below = new Map();
  for (const robot of robots) {
    const own = members(robot.line).map((handle) => byHandle.get(handle)).filter((one) => one && one !== robot);
    if (own.length) below.set(robot, own);
  }
  for (const [group, own] of below) keys.set(group, Math.min(keys.get(group), ...own.map((one) => keys.get(one))));
  const names = new Map(robots.map((robot) => [robot, title(robot.line)]));
  const order = [...robots].sort(
    (a, b) => (down ? -1 : 1) * (keys.get(a) - keys.get(b) || NAMES.compare(names.get(a), names.get(b))) || (a.line.handle < b.line.handle ? -1 : 1),
  );
  const inGroups = new Set([...below.values()].flat());
  const top = order.filter((robot) => !inGroups.has(robot) || below.has(robot));
  return [...new Set([...top.flatMap((robot) => [robot, ...(below.get(robot) ?? [])]), ...order])];
}

/** The robots that count: not a group whose members have rows. */
export function counted(robots) {
  const there = new Set(robots.map(({ line }) => line.handle));
  return robots.filter(({ line }) => !members(line).some((handle) => there.has(handle)));
}

/** The rows of some robots. */
export class Rows {
  constructor(head, body) {
    this.rows = new Map();
    this.drawnAt = -Infinity;
    this.looking = new IntersectionObserver((found) => {
      for (const { target, isIntersecting } of found) target.isSeen = isIntersecting;
    }, { rootMargin: "200px" });
    this.body = document.getElementById(body);
    this.head = document.getElementById(head);
    for (const column of COLUMNS) this.head.append(this.header(column));
  }

  header({ head, field }) {
    return make("th", { role: "columnheader", scope: "col", class: field ? "field" : head.toLowerCase() }, head);
  }

  /** Show these robots, in this order. */
  show(robots) {
    const focused = document.activeElement;
    const seen = new Set();
    const below = new Set(robots.flatMap(({ line }) => members(line)));
    const now = performance.now() / 1000;
    const all = now - this.drawnAt >= UNSEEN;
    if (all) this.drawnAt = now;
    let after = null;
    for (const robot of robots) {
      const known = this.rows.get(robot.line.handle);
      const next = after === null ? this.body.firstChild : after.nextSibling;
      const waits = known !== undefined && !all && known.row === next && known.row.isSeen === false;
      const row = waits ? known.row : this.row(robot);
      row.classList.toggle("member", below.has(robot.line.handle));
      seen.add(robot.line.handle);
      if (next !== row) this.body.insertBefore(row, next);
      after = row;
    }
    for (const [handle, { row }] of this.rows) {
      if (seen.has(handle)) continue;
      this.looking.unobserve(row);
      row.remove();
      this.rows.delete(handle);
    }
    // a row that moves loses the focus
    if (this.body.contains(focused) && document.activeElement !== focused) focused.focus({ preventScroll: true });
  }

  /** Update the age of each heartbeat. */
  age(robots) {
    for (const robot of robots) {
      const known = this.rows.get(robot.line.handle);
      if (!known) continue;
      setText(known.age, robot.line.link?.state === "NEVER_SEEN" ? "" : ago(robot.currentAge()));
      if (known.stale !== robot.stale()) this.row(robot);
    }
  }

  row(robot) {
    const { line } = robot;
    let known = this.rows.get(line.handle);
    if (known?.said === robot.said && known.line === line && known.stale === robot.stale()) return known.row;
    if (!known) {
      this.rows.set(line.handle, (known = newRow(line.handle)));
      this.looking.observe(known.row);
    }
    Object.assign(known, { line, said: robot.said, stale: robot.stale() });
    const headline = robot.headline();
    setText(known.link, title(line));
    setText(known.ids, ids(line));
    setTitle(known.head, `${title(line)} · ${kind(line)} · ${line.handle}`);
    turn(known.state, headline);
    if (known.told !== headline.sentences) {
      known.told = headline.sentences;
      setTitle(known.why.parentNode, headline.sentences.map(plain).join(" "));
      known.why.replaceChildren(...told(headline.sentences));
    }
    FIELDS.forEach((field, n) => showField(known.fields[n], field, robot));
    const link = looks(LINK, robot.stale() ? undefined : line.link?.state);
    turn(known.connection, { ...link, word: link.short });
    const tone = `${headline.tone}${known.row.classList.contains("member") ? " member" : ""}${known.row.classList.contains("new") ? " new" : ""}`;
    if (known.row.className !== tone) known.row.className = tone;
    return known.row;
  }
}

function newRow(handle) {
  const empty = { shape: "unknown", word: "", tone: "unknown" };
  const known = { link: make("a", { href: `#/${encodeURIComponent(handle)}` }), ids: make("small"), age: make("span", { class: "age" }) };
  known.head = make("th", { role: "rowheader", scope: "row" }, known.link, " ", known.ids);
  known.state = chip(empty);
  known.why = make("span");
  known.fields = FIELDS.map(() => chip(empty));
  known.connection = chip(empty);
  const cell = (name, head, ...children) => make("td", { role: "cell", class: name, "data-head": head }, ...children);
  known.row = make("tr", { role: "row" }, cell("state", "State", known.state), known.head, cell("why-cell", "Why", known.why));
  known.row.append(...FIELDS.map((field, n) => cell("field", field.head, known.fields[n])), cell("link", LINK.head, known.connection, " ", known.age));
  return known;
}

function showField(shown, field, robot) {
  const look = looks(field, robot.value(field.name));
  turn(shown, { ...look, word: look.short });
  const mode = field.name === "mode" ? robot.line.vehicle?.flight_mode : null;
  const code = field.name === "in_error" && robot.value("in_error") === true ? ` ${robot.line.error_code}` : "";
  setTitle(shown.parentNode, `${field.title}: ${look.word}${code}${mode ? ` (${mode})` : ""}`);
}

function setTitle(element, text) {
  if (element.title !== text) element.title = text;
}

/** All robots: filters with their counts, search, sorting. */
export class Fleet extends Rows {
  constructor() {
    super("head", "rows");
    this.column = COLUMNS[0];
    this.down = false;
    this.filter = FILTERS[0];
    this.order = [];
    this.problems = "";
    this.orderedAt = this.pointed = -Infinity;
    this.body.addEventListener("pointermove", () => (this.pointed = performance.now() / 1000));
    this.buttons = FILTERS.map((filter) => this.button(filter));
    document.getElementById("filters").append(...this.buttons);
    this.search = document.getElementById("search");
    this.search.addEventListener("input", () => this.again());
    this.mark();
  }

  button(filter) {
    const button = make("button", { type: "button", class: `plain ${filter.tone}` }, make("b"), ` ${filter.name}`);
    button.addEventListener("click", () => {
      this.filter = this.filter === filter ? FILTERS[0] : filter;
      this.again();
    });
    return button;
  }

  header(column) {
    const cell = super.header(column);
    if (!column.of) return cell;
    const button = make("button", { type: "button", class: "plain" }, column.head);
    button.addEventListener("click", () => {
      this.down = this.column === column && !this.down;
      this.column = column;
      this.mark();
      this.again();
    });
    cell.replaceChildren(button);
    cell.column = column;
    return cell;
  }

  mark() {
    for (const cell of this.head.children) {
      if (cell.column === this.column) cell.setAttribute("aria-sort", this.down ? "descending" : "ascending");
      else cell.removeAttribute("aria-sort");
    }
  }

  /** Show the same robots again, after a person asked for another order or choice. */
  again() {
    this.orderedAt = this.pointed = -Infinity;
    this.showAll(this.robots ?? [], this.leftOut);
  }

  showAll(robots, leftOut = 0) {
    [this.robots, this.leftOut] = [robots, leftOut];
    const order = this.held(sorted(robots, this.column, this.down));
    const text = this.search.value.trim().toLowerCase();
    const found = order.filter((robot) => this.filter.has(robot) && (text === "" || words(robot).includes(text)));
    this.show(found);
    this.count(robots, leftOut);
    document.getElementById("empty").hidden = robots.length > 0;
    document.getElementById("none").hidden = robots.length === 0 || found.length > 0;
    this.spread(found.length);
  }

  /** In the order of before while a person points at a row, or if nobody has another urgent problem than a moment ago. */
  held(order) {
    const now = performance.now() / 1000;
    const problems = order.filter((robot) => robot.headline().rank < URGENT).map((robot) => `${robot.headline().rank} ${robot.line.handle}`).join("\n");
    const same = problems === this.problems && order.length === this.order.length && now - this.orderedAt < HELD;
    if (now - this.pointed < HELD || same) {
      const places = new Map(this.order.map((handle, n) => [handle, n]));
      const placeOf = ({ line }) => places.get(line.handle) ?? places.size;
      order.sort((a, b) => placeOf(a) - placeOf(b));
    } else {
      [this.orderedAt, this.problems] = [now, problems];
    }
    this.order = order.map(({ line }) => line.handle);
    return order;
  }

  count(robots, leftOut) {
    const single = counted(robots);
    FILTERS.forEach((filter, n) => {
      const count = single.filter(filter.has).length;
      setText(this.buttons[n].firstChild, `${count}`);
      this.buttons[n].setAttribute("aria-pressed", `${filter === this.filter}`);
      this.buttons[n].classList.toggle("some", count > 0);
    });
    this.errors = single.filter(FILTERS[1].has).length;
    setText(document.getElementById("fleet-title"), number(single.length));
    setText(document.getElementById("left-out"), left(leftOut));
  }

  /** On a wide screen, robots that do not fit below each other stand in columns. */
  spread(rows) {
    const shape = `${rows} ${innerWidth} ${innerHeight}`;
    if (shape === this.shape || !rows) return;
    this.shape = shape;
    const fit = Math.max(Math.floor((innerHeight - this.body.getBoundingClientRect().top - scrollY) / 32), 10);
    const needed = innerWidth < 1600 ? 1 : Math.ceil(rows / fit);
    const columns = needed <= innerWidth / 620 ? needed : 1;
    document.body.classList.toggle("columns", columns > 1);
    document.body.style.setProperty("--columns", columns);
  }
}

/** `254 robots`. */
export function number(count) {
  return count === 1 ? "1 robot" : `${count} robots`;
}

/** How many senders the gateway leaves out, in words; empty: none. */
export function left(count) {
  if (!count) return "";
  return `${count} more ${count === 1 ? "sender is" : "senders are"} not shown: the gateway has no room for ${count === 1 ? "it" : "them"}.`;
}

/** What a search looks at. */
function words(robot) {
  const headline = robot.headline();
  return [title(robot.line), robot.line.handle, kind(robot.line), headline.word, ...headline.sentences.map(plain)].join(" ").toLowerCase();
}
