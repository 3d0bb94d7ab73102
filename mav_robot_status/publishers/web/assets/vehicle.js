// One robot or group: its headline, its members, the explanation, and the last ten minutes.

import { Rows } from "./fleet.js";
import { bands } from "./bands.js";
import { chip, isolated, make, setText, shape, told } from "./make.js";
import { kind, members, title } from "./robot.js";
import { ago, clock, FIELDS, lastKnown, LINK, looks } from "./words.js";

const WHY = ["Field", "Value", "Rule", "Read from", "Age"];
const MOST_CHANGES = 60;
const WINDOW = 600; // s

const at = (id) => document.getElementById(id);

export class VehiclePage {
  constructor() {
    this.members = new Rows("members-head", "members-rows");
    for (const name of WHY) at("why-head").append(make("th", { role: "columnheader", scope: "col" }, name));
    this.open(null);
  }

  /** Switch to another vehicle. */
  open(handle) {
    this.handle = handle;
    this.line = null;
    this.history = { transitions: [], since: new Map() };
    this.explanation = null;
    for (const id of ["verdict", "causes", "tiles", "bands", "why", "changes"]) at(id).replaceChildren();
    this.members.show([]);
    at("members").hidden = true;
    setText(at("vehicle-title"), handle ?? "");
    setText(at("who"), "Waiting for the gateway …");
    at("no-why").hidden = false;
  }

  /** Add the whole history, or its new part. Ages count from `now`. */
  take(data, now) {
    const news = data.transitions.map((t) => ({ ...t, at: now - t.ago }));
    const ago = (stamp) => (new Date(data.now) - new Date(stamp)) / 1000;
    const since = new Map(Object.entries(data.kept_since).map(([name, stamp]) => [name, now - ago(stamp)]));
    const kept = data.whole ? [] : this.history.transitions;
    const transitions = [...kept, ...news].filter((t) => now - t.at <= WINDOW && t.at >= since.get(t.name) - 0.01);
    this.history = { transitions, since };
    const recent = withoutTheLost(transitions).slice(-MOST_CHANGES).reverse();
    at("changes").replaceChildren(...recent.map(change));
  }

  explain(explanation) {
    at("no-why").hidden = true;
    at("why").replaceChildren(...FIELDS.map((field) => reason(field, explanation.fields?.[field.name] ?? {})));
  }

  /** Show the current status; for a group also the statuses of its members among `robots`. */
  show(robot, robots) {
    this.parts = members(robot.line).map((handle) => robots.get(handle)).filter((part) => part);
    at("members").hidden = this.parts.length === 0;
    this.members.show(this.parts);
    if (this.line === robot.line && this.said === robot.said && this.about === robot.about && this.stale === robot.stale()) return;
    const line = (this.line = robot.line);
    [this.said, this.about, this.stale] = [robot.said, robot.about, robot.stale()];
    setText(at("vehicle-title"), title(line));
    setText(at("who"), [kind(line), title(line) === line.handle ? "" : line.handle].filter((part) => part).join(" · "));
    const headline = robot.headline();
    at("verdict").className = headline.tone;
    at("verdict").replaceChildren(...banner(headline));
    at("causes").replaceChildren(...causeLists(line, this.stale ? [] : robot.about.causes));
    at("tiles").replaceChildren(...FIELDS.map((field) => tile(field, robot)), linkTile(robot));
    if (this.stale) {
      // the reasons are those of a status that is not known any more
      at("why").replaceChildren();
      at("no-why").hidden = false;
    }
  }

  /** The title of the window. */
  title(robot) {
    return `${robot.headline().word} – ${title(robot.line)}`;
  }

  /** Update the ages. */
  age(robot, live, now) {
    this.members.age(this.parts ?? []);
    if (this.line && this.stale !== robot.stale()) this.show(robot, new Map((this.parts ?? []).map((part) => [part.line.handle, part])));
    const asof = at("asof");
    if (!asof || !this.line) return;
    const age = this.line.link?.state === "NEVER_SEEN" ? "no heartbeat yet" : `heard ${ago(robot.currentAge())}`;
    setText(asof, live && !robot.stale() ? age : `as of ${clock(robot.stamp)}`);
    setText(at("link-age"), age);
    const transitions = this.history.transitions.map((t) => ({ ...t, ago: now - t.at }));
    const keptFor = (name) => now - (this.history.since.get(name) ?? now);
    at("bands").replaceChildren(...bands(this.line, transitions, keptFor, live ? 0 : now - robot.at, Date.now()));
  }
}

/** The headline: the word, why, and the next step. */
function banner({ shape: name, word, sentences, step, topic }) {
  const parts = [make("p", { class: "word", role: "status" }, shape(name), make("strong", {}, word)), make("p", { class: "told" }, ...told(sentences))];
  if (step) parts.push(make("p", { class: "step" }, make("b", {}, "Next: "), topic ? helped(topic, step) : step));
  return [...parts, make("p", { class: "asof", id: "asof" })];
}

/** A link to the help of a topic. */
function helped(topic, words) {
  return make("a", { href: `help.html#${encodeURIComponent(topic)}` }, words);
}

function causeLists(line, causes) {
  const heads = { errors: "Errors", inhibits: line.motion_possible === false ? "Why motion is not possible" : "Why motion may not be possible", unheard: "Why this is unknown" };
  const lists = [];
  for (const [name, head] of Object.entries(heads)) {
    const own = causes.filter((cause) => cause.list === name);
    if (!own.length) continue;
    const top = make("h2", {}, ...(name === "errors" ? [shape("fault")] : []), head);
    lists.push(make("section", { class: name }, top, make("ul", {}, ...own.map(causeItem))));
  }
  const blocked = line.vehicle?.modes_blocked;
  if (Array.isArray(blocked) && blocked.length) {
    const modes = make("li", {}, isolated(blocked.join(", ")));
    lists.push(make("section", {}, make("h2", {}, "Modes that cannot be armed"), make("ul", {}, modes)));
  }
  return lists;
}

/** A cause: in words, what the autopilot says, what to do; then its name and its time. */
function causeItem(cause) {
  const item = make("li", {}, make("b", {}, isolated(member(cause) ? member(cause) + cause.words : begun(cause.words))));
  if (cause.text) item.append(" ", isolated(cause.list === "unheard" ? `(${cause.text})` : `“${cause.text}”`));
  if (cause.step) item.append(make("span", { class: "do" }, cause.topic ? helped(cause.topic, cause.step) : cause.step));
  const name = make("code", {}, [cause.code, cause.name].filter((part) => part !== undefined).join(" "));
  item.append(make("small", {}, name, cause.since ? ` since ${clock(cause.since)}` : ""));
  return item;
}

/** With a capital letter at its beginning. */
function begun(words) {
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/** The member of a group that reports a cause, for the front of its words. */
function member(cause) {
  return cause?.handle === undefined || cause.handle === null ? "" : `${cause.handle}: `;
}

function tile(field, robot) {
  const { line } = robot;
  const value = make("dd", {}, chip(looks(field, robot.value(field.name))));
  const last = looks(field, robot.last(field.name));
  if (robot.last(field.name) !== undefined && last.shape !== "unknown") value.append(make("small", { class: "last" }, lastKnown(last)));
  else if (field.name === "mode" && line.vehicle?.flight_mode) value.append(make("small", {}, isolated(line.vehicle.flight_mode)));
  else if (field.name === "in_error" && line.in_error === true) value.append(make("small", {}, `code ${line.error_code}`));
  return make("div", {}, make("dt", {}, field.title), value);
}

function linkTile(robot) {
  const look = looks(LINK, robot.stale() ? undefined : robot.line.link?.state);
  return make("div", {}, make("dt", {}, LINK.title), make("dd", {}, chip(look), make("small", { id: "link-age" })));
}

/** The rule that decided, and below it what would make an unknown field known. */
function rule(found) {
  return found.next ? make("div", {}, isolated(found.rule ?? "–"), make("small", {}, found.next)) : isolated(found.rule ?? "–");
}

function reason(field, found) {
  const cells = [chip(looks(field, found.value)), rule(found), isolated(found.source ?? "–"), typeof found.age === "number" ? `${found.age.toFixed(1)} s` : "–"];
  const head = make("th", { role: "rowheader", scope: "row" }, field.title);
  return make("tr", { role: "row" }, head, ...cells.map((cell, n) => make("td", { role: "cell", "data-head": WHY[n + 1] }, cell)));
}

/** The changes, without the values that a lost link makes unknown: the change of the link says it. */
function withoutTheLost(transitions) {
  const losses = new Set(transitions.filter((t) => t.name === LINK.name && t.value !== "CONNECTED").map((t) => t.stamp));
  return transitions.filter((t) => t.name === LINK.name || !losses.has(t.stamp) || !(t.value === null || t.value === "UNKNOWN"));
}

function change({ stamp, name, value }) {
  const time = make("time", { datetime: stamp }, clock(stamp));
  const field = [...FIELDS, LINK].find((one) => one.name === name);
  if (field) return make("li", {}, time, make("span", {}, field.title), chip(looks(field, value)));
  if (name === "flight_mode") return make("li", {}, time, make("span", {}, "Flight mode"), isolated(value ?? "–"));
  const words = make("b", {}, isolated(member(value) + String(value?.words)));
  const text = make("span", {}, words, value?.text ? isolated(` “${value.text}”`) : "", " ", make("code", {}, String(value?.name)));
  const what = name === "error" ? "Error" : "Reason";
  return make("li", {}, time, make("span", {}, `${what} ${value?.begins ? "begins" : "ends"}`), text);
}
