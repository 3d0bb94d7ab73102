// The table of robots, one line each, and that of the members of a group. Rows are updated in place, so that keyboard
// focus is kept.

import { FIELDS, LINK, looks, plain, span } from "./words.js";
import { chip, make, setText, told } from "./make.js";
import { ids, kind, members, title } from "./robot.js";

const HELD = 2; // s after a movement of the pointer over the table during which no row changes its place
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

/** The rows of some robots. */
export class Rows {
  constructor(head, body) {
    this.rows = new Map();
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
    let after = null;
    for (const robot of robots) {
      const row = this.row(robot);
      row.classList.toggle("member", below.has(robot.line.handle));
      seen.add(robot.line.handle);
      const next = after === null ? this.body.firstChild : after.nextSibling;
      if (next !== row) this.body.insertBefore(row, next);
      after = row;
    }
    for (const [handle, { row }] of this.rows) {
      if (seen.has(handle)) continue;
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
      setText(known.age, robot.line.link?.state === "NEVER_SEEN" ? "" : span(robot.currentAge()));
      if (known.stale !== robot.stale()) this.row(robot);
    }
  }

  row(robot) {
    const { line } = robot;
    let known = this.rows.get(line.handle);
    if (known?.said === robot.said && known.line === line && known.stale === robot.stale()) return known.row;
    if (!known) {
      known = { row: make("tr", { role: "row" }), link: make("a", { href: `#/${encodeURIComponent(line.handle)}` }), age: make("span", { class: "age" }) };
      known.ids = make("small");
      known.head = make("th", { role: "rowheader", scope: "row" }, known.link, " ", known.ids);
      this.rows.set(line.handle, known);
    }
    Object.assign(known, { line, said: robot.said, stale: robot.stale() });
    const headline = robot.headline();
    setText(known.link, title(line));
    setText(known.ids, ids(line));
    known.head.title = `${title(line)} · ${kind(line)} · ${line.handle}`;
    const focused = document.activeElement === known.link;
    const state = make("td", { role: "cell", class: "state" }, chip(headline));
    known.row.replaceChildren(state, known.head, why(headline), ...FIELDS.map((field) => cell(field, robot)), linked(robot, known.age));
    if (focused) known.link.focus({ preventScroll: true });
    known.row.className = headline.tone;
    return known.row;
  }
}

function cell(field, robot) {
  const look = looks(field, robot.value(field.name));
  const shown = make("td", { role: "cell", class: "field", "data-head": field.head }, chip({ ...look, word: look.short }));
  const mode = field.name === "mode" ? robot.line.vehicle?.flight_mode : null;
  const code = field.name === "in_error" && robot.value("in_error") === true ? ` ${robot.line.error_code}` : "";
  shown.title = `${field.title}: ${look.word}${code}${mode ? ` (${mode})` : ""}`;
  return shown;
}

function why(headline) {
  const words = headline.sentences.map(plain).join(" ");
  return make("td", { role: "cell", class: "why-cell", "data-head": "Why", title: words }, make("span", {}, ...told(headline.sentences)));
}

function linked(robot, age) {
  const look = looks(LINK, robot.stale() ? undefined : robot.line.link?.state);
  return make("td", { role: "cell", class: "link", "data-head": LINK.head }, chip({ ...look, word: look.short }), " ", age);
}

/** All robots: filters with their counts, search, sorting. */
export class Fleet extends Rows {
  constructor() {
    super("head", "rows");
    this.column = COLUMNS[0];
    this.down = false;
    this.filter = FILTERS[0];
    this.order = [];
    this.pointed = -Infinity;
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
    this.pointed = -Infinity;
    this.showAll(this.robots ?? []);
  }

  showAll(robots) {
    this.robots = robots;
    const held = performance.now() / 1000 - this.pointed < HELD;
    const order = sorted(robots, this.column, this.down);
    if (held) order.sort((a, b) => at(this.order, a) - at(this.order, b));
    this.order = order.map(({ line }) => line.handle);
    const text = this.search.value.trim().toLowerCase();
    const found = order.filter((robot) => this.filter.has(robot) && (text === "" || words(robot).includes(text)));
    this.show(found);
    this.count(robots);
    document.getElementById("empty").hidden = robots.length > 0;
    document.getElementById("none").hidden = robots.length === 0 || found.length > 0;
    this.wall(found.length);
  }

  count(robots) {
    // a group whose members have rows is not counted again
    const there = new Set(robots.map(({ line }) => line.handle));
    const single = robots.filter(({ line }) => !members(line).some((handle) => there.has(handle)));
    FILTERS.forEach((filter, n) => {
      const count = single.filter(filter.has).length;
      setText(this.buttons[n].firstChild, `${count}`);
      this.buttons[n].setAttribute("aria-pressed", `${filter === this.filter}`);
      this.buttons[n].classList.toggle("some", count > 0);
    });
    this.errors = single.filter(FILTERS[1].has).length;
  }

  /** On a wide screen, robots that do not fit below each other stand in columns. */
  wall(rows) {
    const fit = Math.max(Math.floor((innerHeight - this.body.getBoundingClientRect().top - scrollY) / 32), 10);
    const columns = innerWidth < 1600 ? 1 : Math.min(Math.ceil(rows / fit), Math.floor(innerWidth / 620));
    document.body.classList.toggle("wall", columns > 1);
    document.body.style.setProperty("--columns", columns);
  }
}

/** Where a robot was; a new one is last. */
function at(order, robot) {
  const found = order.indexOf(robot.line.handle);
  return found < 0 ? order.length : found;
}

/** What a search looks at. */
function words(robot) {
  const headline = robot.headline();
  return [title(robot.line), robot.line.handle, kind(robot.line), headline.word, ...headline.sentences.map(plain)].join(" ").toLowerCase();
}
