// The table of all vehicles. Rows are updated in place, so that keyboard focus is kept.

import { FIELDS, LINK, looks, span } from "./words.js";
import { chip, isolated, make, setText } from "./make.js";

const COLUMNS = ["Vehicle", ...FIELDS.map((field) => field.head), "Why", LINK.head];

/** The title of a vehicle: its handle, or its system id for a default handle. */
export function title(line) {
  const handle = String(line.handle ?? "?");
  if (!/^industrial_robot_status_handle(\/\d+\.\d+)?$/.test(handle)) return handle;
  return line.system === null || line.system === undefined ? handle : `System ${line.system}`;
}

/** Ids, autopilot with its firmware, and type in one line. */
export function kind(line) {
  const ids = line.system === null || line.system === undefined ? null : `${line.system}.${line.component}`;
  const autopilot = [line.vehicle?.autopilot, line.vehicle?.firmware].filter((part) => part).join(" ");
  return [ids, autopilot, line.vehicle?.type].filter((part) => part).join(" · ");
}

/** Errors and reasons why motion is not possible, as list items. */
export function causes(line) {
  const items = [];
  for (const [group, tone] of [["errors", "danger"], ["inhibits", "plain"]]) {
    for (const cause of Array.isArray(line[group]) ? line[group] : []) {
      const code = group === "errors" ? `${cause.code} ` : "";
      const item = make("li", { class: tone }, make("b", {}, code + String(cause.name)));
      if (cause.text) item.append(" ", isolated(`“${cause.text}”`));
      items.push([item, cause]);
    }
  }
  return items;
}

export class Fleet {
  constructor() {
    this.rows = new Map();
    this.body = document.getElementById("rows");
    for (const name of COLUMNS) document.getElementById("head").append(make("th", { role: "columnheader", scope: "col" }, name));
  }

  /** Show these vehicles, in this order. */
  show(vehicles) {
    const seen = new Set();
    let after = null;
    for (const vehicle of vehicles) {
      const row = this.row(vehicle);
      seen.add(vehicle.line.handle);
      const next = after === null ? this.body.firstChild : after.nextSibling;
      if (next !== row) this.body.insertBefore(row, next);
      after = row;
    }
    for (const [handle, { row }] of this.rows) {
      if (seen.has(handle)) continue;
      row.remove();
      this.rows.delete(handle);
    }
    const errors = vehicles.filter(({ line }) => line.in_error === true).length;
    const lost = vehicles.filter(({ line }) => line.link?.state !== "CONNECTED").length;
    const count = vehicles.length === 1 ? "1 vehicle" : `${vehicles.length} vehicles`;
    setText(document.getElementById("count"), `${count}, ${errors} in error, ${lost} without a link`);
    document.getElementById("count").hidden = vehicles.length === 0;
    document.getElementById("empty").hidden = vehicles.length > 0;
    document.title = `${errors ? `(${errors}!) ` : ""}RobotStatus`;
  }

  /** Update the age of each heartbeat. */
  age(vehicles) {
    for (const vehicle of vehicles) {
      const known = this.rows.get(vehicle.line.handle);
      if (!known) continue;
      setText(known.age, vehicle.line.link?.state === "NEVER_SEEN" ? "" : span(vehicle.currentAge()));
      known.row.classList.toggle("stale", vehicle.stale());
    }
  }

  row(vehicle) {
    const { line } = vehicle;
    let known = this.rows.get(line.handle);
    if (known?.line === line) return known.row;
    if (!known) {
      known = { row: make("tr", { role: "row" }), link: make("a", { href: `#/${encodeURIComponent(line.handle)}` }), age: make("span", { class: "age" }) };
      known.head = make("th", { role: "rowheader", scope: "row" }, known.link, make("small"), make("small", { class: "handle" }, line.handle));
      this.rows.set(line.handle, known);
    }
    known.line = line;
    setText(known.link, title(line));
    setText(known.head.children[1], kind(line));
    known.head.children[2].hidden = title(line) === line.handle;
    const focused = document.activeElement === known.link;
    known.row.replaceChildren(known.head, ...FIELDS.map((field) => this.cell(field, line)), this.why(line), this.link(line, known.age));
    if (focused) known.link.focus({ preventScroll: true });
    known.row.className = line.in_error === true ? "in-error" : "";
    return known.row;
  }

  cell(field, line) {
    const look = looks(field, line[field.name]);
    const cell = make("td", { role: "cell", "data-head": field.head }, chip(look));
    if (field.name === "mode") cell.append(make("small", {}, isolated(line.vehicle?.flight_mode ?? "")));
    if (field.name === "in_error" && line.in_error === true) cell.append(make("small", {}, String(line.error_code)));
    return cell;
  }

  why(line) {
    const items = causes(line).map(([item]) => item);
    return make("td", { role: "cell", class: "causes", "data-head": "Why" }, items.length ? make("ul", {}, ...items) : "");
  }

  link(line, age) {
    return make("td", { role: "cell", class: "link", "data-head": LINK.head }, chip(looks(LINK, line.link?.state)), age);
  }
}
