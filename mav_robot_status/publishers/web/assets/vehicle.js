// One vehicle: its verdict, the explanation, and the last ten minutes.

import { causes, kind, title } from "./fleet.js";
import { bands } from "./bands.js";
import { chip, isolated, make, setText, shape } from "./make.js";
import { clock, FIELDS, LINK, looks, span, verdict } from "./words.js";

const WHY = ["Field", "Value", "Rule", "Read from", "Age"];
const MOST_CHANGES = 60;
const WINDOW = 600; // s

const at = (id) => document.getElementById(id);

export class VehiclePage {
  constructor() {
    for (const name of WHY) at("why-head").append(make("th", { role: "columnheader", scope: "col" }, name));
    this.open(null);
  }

  /** Switch to another vehicle. */
  open(handle) {
    this.handle = handle;
    this.line = null;
    this.history = { transitions: [], knownFor: 0, at: 0 };
    this.explanation = null;
    for (const id of ["verdict", "causes", "tiles", "bands", "why", "changes"]) at(id).replaceChildren();
    setText(at("vehicle-title"), handle ?? "");
    setText(at("who"), "Waiting for the gateway …");
    at("no-why").hidden = false;
  }

  /** Add the whole history, or its new part. Ages count from `now`. */
  take(data, now) {
    const news = data.transitions.map((t) => ({ ...t, at: now - t.ago }));
    const kept = data.whole ? [] : this.history.transitions;
    const transitions = [...kept, ...news].filter((t) => now - t.at <= WINDOW || t.at > now);
    this.history = { transitions, since: now - data.known_for };
    const recent = transitions.slice(-MOST_CHANGES).reverse();
    at("changes").replaceChildren(...recent.map(change));
  }

  explain(explanation) {
    at("no-why").hidden = true;
    at("why").replaceChildren(...FIELDS.map((field) => reason(field, explanation.fields?.[field.name] ?? {})));
  }

  /** Show the current status. */
  show(vehicle) {
    if (this.line === vehicle.line) return;
    const line = (this.line = vehicle.line);
    setText(at("vehicle-title"), title(line));
    setText(at("who"), [kind(line), title(line) === line.handle ? "" : line.handle].filter((part) => part).join(" · "));
    const { shape: name, word, tone, detail } = verdict(line);
    const large = make("p", { class: "word", role: "status" }, shape(name), make("strong", {}, word));
    at("verdict").className = tone;
    at("verdict").replaceChildren(large, make("p", {}, isolated(detail)), make("p", { class: "asof", id: "asof" }), make("p", { class: "asof" }, "Information, not a safety function."));
    at("causes").replaceChildren(...causeLists(line));
    at("tiles").replaceChildren(...FIELDS.map((field) => tile(field, line)), linkTile(line));
    document.title = `${word} – ${title(line)}`;
  }

  /** Update the ages. */
  age(vehicle, live, now) {
    const asof = at("asof");
    if (!asof || !this.line) return;
    const age = this.line.link?.state === "NEVER_SEEN" ? "no heartbeat yet" : `last heartbeat ${span(vehicle.currentAge())} ago`;
    setText(asof, live && !vehicle.stale() ? `now, ${age}` : `as of ${clock(vehicle.stamp)}, ${age}`);
    setText(at("link-age"), age);
    const ago = this.history.transitions.map((t) => ({ ...t, ago: now - t.at }));
    const known = { transitions: ago, knownFor: now - (this.history.since ?? now) };
    at("bands").replaceChildren(...bands(this.line, known, live ? 0 : now - vehicle.at, Date.now()));
  }
}

function causeLists(line) {
  const lists = [];
  for (const [group, head] of [["errors", "Error"], ["inhibits", "Why motion is not possible"]]) {
    const own = causes(line).filter(([, cause]) => line[group].includes(cause));
    if (!own.length) continue;
    for (const [item, cause] of own) item.append(make("small", {}, ` since ${clock(cause.since)}`));
    const top = make("h2", {}, ...(group === "errors" ? [shape("error")] : []), head);
    lists.push(make("section", { class: group }, top, make("ul", {}, ...own.map(([item]) => item))));
  }
  return lists;
}

function tile(field, line) {
  const value = make("dd", {}, chip(looks(field, line[field.name])));
  if (field.name === "mode" && line.vehicle?.flight_mode) value.append(make("small", {}, isolated(line.vehicle.flight_mode)));
  if (field.name === "in_error" && line.in_error === true) value.append(make("small", {}, `code ${line.error_code}`));
  return make("div", {}, make("dt", {}, field.title), value);
}

function linkTile(line) {
  return make("div", {}, make("dt", {}, LINK.title), make("dd", {}, chip(looks(LINK, line.link?.state)), make("small", { id: "link-age" })));
}

function reason(field, found) {
  const cells = [chip(looks(field, found.value)), isolated(found.rule ?? "–"), isolated(found.source ?? "–"), typeof found.age === "number" ? `${found.age.toFixed(1)} s` : "–"];
  const head = make("th", { role: "rowheader", scope: "row" }, field.title);
  return make("tr", { role: "row" }, head, ...cells.map((cell, n) => make("td", { role: "cell", "data-head": WHY[n + 1] }, cell)));
}

function change({ stamp, name, value }) {
  const time = make("time", { datetime: stamp }, clock(stamp));
  const field = [...FIELDS, LINK].find((one) => one.name === name);
  if (field) return make("li", {}, time, make("span", {}, field.title), chip(looks(field, value)));
  if (name === "flight_mode") return make("li", {}, time, make("span", {}, "Flight mode"), isolated(value ?? "–"));
  const text = make("span", {}, make("b", {}, String(value?.name)), value?.text ? " " : "", value?.text ? isolated(`“${value.text}”`) : "");
  const what = name === "error" ? "Error" : "Reason";
  return make("li", {}, time, make("span", {}, `${what} ${value?.begins ? "begins" : "ends"}`), text);
}
