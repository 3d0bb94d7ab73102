// One vehicle: its state in large, why, and the last ten minutes.

import { causes, kind, title } from "./fleet.js";
import { bands } from "./bands.js";
import { chip, make, said, say, shape } from "./make.js";
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

  /** Begin with another vehicle. */
  open(handle) {
    this.handle = handle;
    this.line = null;
    this.history = { transitions: [], knownFor: 0, at: 0 };
    this.explanation = null;
    for (const id of ["verdict", "causes", "tiles", "bands", "why", "changes"]) at(id).replaceChildren();
    say(at("vehicle-title"), handle ?? "");
    say(at("who"), "waiting for the gateway …");
    at("no-why").hidden = false;
  }

  /** Its history: all of it, or what is new. Times are counted from here on. */
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

  /** What it is now. */
  show(vehicle) {
    if (this.line === vehicle.line) return;
    const line = (this.line = vehicle.line);
    say(at("vehicle-title"), title(line));
    say(at("who"), [kind(line), title(line) === line.handle ? "" : line.handle].filter((part) => part).join(" · "));
    const { shape: name, word, tone, says } = verdict(line);
    const large = make("p", { class: "word", role: "status" }, shape(name), make("strong", {}, word));
    at("verdict").className = tone;
    at("verdict").replaceChildren(large, make("p", {}, said(says)), make("p", { class: "asof", id: "asof" }), make("p", { class: "asof" }, "It informs; it is no safety function."));
    at("causes").replaceChildren(...causeLists(line));
    at("tiles").replaceChildren(...FIELDS.map((field) => tile(field, line)), linkTile(line));
    document.title = `${word} – ${title(line)}`;
  }

  /** What changes with time alone. */
  age(vehicle, live, now) {
    const asof = at("asof");
    if (!asof || !this.line) return;
    const heard = this.line.link?.state === "NEVER_SEEN" ? "never heard" : `last heard ${span(vehicle.heardAge())} ago`;
    say(asof, live && !vehicle.stale() ? `now, ${heard}` : `as of ${clock(vehicle.stamp)}, ${heard}`);
    say(at("link-age"), heard);
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
  if (field.name === "mode" && line.vehicle?.flight_mode) value.append(make("small", {}, said(line.vehicle.flight_mode)));
  if (field.name === "in_error" && line.in_error === true) value.append(make("small", {}, `code ${line.error_code}`));
  return make("div", {}, make("dt", {}, field.ask), value);
}

function linkTile(line) {
  return make("div", {}, make("dt", {}, LINK.ask), make("dd", {}, chip(looks(LINK, line.link?.state)), make("small", { id: "link-age" })));
}

function reason(field, found) {
  const cells = [chip(looks(field, found.value)), said(found.rule ?? "–"), said(found.source ?? "–"), typeof found.age === "number" ? `${found.age.toFixed(1)} s` : "–"];
  const head = make("th", { role: "rowheader", scope: "row" }, field.ask);
  return make("tr", { role: "row" }, head, ...cells.map((cell, n) => make("td", { role: "cell", "data-head": WHY[n + 1] }, cell)));
}

function change({ stamp, name, value }) {
  const time = make("time", { datetime: stamp }, clock(stamp));
  const field = [...FIELDS, LINK].find((one) => one.name === name);
  if (field) return make("li", {}, time, make("span", {}, field.ask), chip(looks(field, value)));
  if (name === "flight_mode") return make("li", {}, time, make("span", {}, "Flight mode"), said(value ?? "–"));
  const text = make("span", {}, make("b", {}, String(value?.name)), value?.text ? " " : "", value?.text ? said(`“${value.text}”`) : "");
  const what = name === "error" ? "Error" : "Reason";
  return make("li", {}, time, make("span", {}, `${what} ${value?.begins ? "begins" : "ends"}`), text);
}
