// The page: it holds the data of the gateway, and shows the fleet or one robot.

import { Alarms } from "./alarm.js";
import { Fleet } from "./fleet.js";
import { Robot } from "./robot.js";
import { Stream } from "./stream.js";
import { VehiclePage } from "./vehicle.js";
import { chip, setText } from "./make.js";
import * as wall from "./wall.js";
import { clock, LINK, looks, span } from "./words.js";

const TOKEN = "mav-robot-status token";
const LIST = "?all"; // the address of the list, even if it has a single robot
const at = (id) => document.getElementById(id);
const seconds = () => performance.now() / 1000;

document.body.classList.toggle("wall", wall.isWall);
const page = { robots: new Map(), leftOut: 0, state: "connecting", receivedAt: null, receivedStamp: null, standing: null, staleAfter: null, wanted: null, list: false };
const fleet = new Fleet();
const one = new VehiclePage();
const alarms = new Alarms((handle) => {
  const headers = { "X-Requested-With": "mav-robot-status", ...authorization() };
  fetch(`api/v1/acknowledge${handle === null ? "" : `?handle=${encodeURIComponent(handle)}`}`, { method: "POST", headers });
});
let stream = null;

const on = {
  event(name, data) {
    const now = seconds();
    if (name === "history") return data.handle === one.handle && (one.take(data, now), render());
    if (name === "explanation") return data.handle === one.handle && one.explain(data);
    if (name === "about") return page.robots.get(data.handle)?.tell(data);
    [page.state, page.receivedAt, page.receivedStamp, page.standing] = ["live", now, data.now, data.standing];
    if (name === "board") {
      page.robots.clear();
      page.staleAfter = data.stale_after;
      setText(at("source"), `${data.source}`);
      at("source").title = `mav-robot-status ${data.version}`;
      alarms.enable(data.alarm === true);
    }
    page.leftOut = data.left_out;
    for (const line of data.vehicles) {
      const known = page.robots.get(line.handle);
      if (known) known.set(line);
      else page.robots.set(line.handle, new Robot(line));
    }
    for (const [handle, said] of Object.entries(data.headlines)) page.robots.get(handle)?.say(said);
    alarms.take(data.events, data.pending);
    for (const [handle, beat] of Object.entries(data.beats ?? {})) page.robots.get(handle)?.heartbeat(...beat);
    // `beats` names every robot that the gateway has
    if (data.beats) for (const handle of [...page.robots.keys()]) if (!(handle in data.beats)) page.robots.delete(handle);
    turn();
    return render();
  },
  lost() {
    page.state = "lost";
    render();
  },
  denied() {
    page.state = "denied";
    at("wrong").hidden = sessionStorage.getItem(TOKEN) === null;
    sessionStorage.removeItem(TOKEN);
    render();
    at("token-field").value = "";
    at("token-field").focus();
  },
};

/** The robot to show: the chosen one, or the only one; null is the list. */
function wanted() {
  if (page.wanted !== null || page.list || page.robots.size !== 1) return page.wanted;
  return page.robots.keys().next().value;
}

/** Turn to the robot to show. */
function turn() {
  if (wall.isWall || wanted() === one.handle) return;
  one.open(wanted());
  connect();
}

function render() {
  const denied = page.state === "denied";
  const robot = page.robots.get(one.handle);
  at("token").hidden = !denied;
  at("fleet").hidden = denied || one.handle !== null || page.receivedAt === null;
  at("vehicle").hidden = denied || one.handle === null || page.receivedAt === null;
  freeze();
  at("wall").hidden = denied || !wall.isWall;
  if (wall.isWall) {
    at("fleet").hidden = true;
    wall.show([...page.robots.values()], page.leftOut);
  } else if (one.handle === null) fleet.showAll([...page.robots.values()], page.leftOut);
  else if (robot) one.show(robot, page.robots);
  else {
    if (one.line) one.open(one.handle);
    setText(at("who"), "The gateway has no such robot.");
  }
  age();
}

/** While nothing arrives from the gateway, every robot is unknown. */
function freeze() {
  const frozen = page.state === "lost" || page.standing !== null ? page.receivedStamp : null;
  for (const robot of page.robots.values()) Object.assign(robot, { frozen, staleAfter: page.staleAfter });
}

function age() {
  freeze();
  const live = page.state === "live" && page.standing === null;
  document.body.classList.toggle("stale", page.state === "lost" || page.standing !== null);
  const states = {
    live: { shape: "bars", word: "live", tone: "calm" },
    connecting: { shape: "ring", word: "connecting …", tone: "unknown" },
    lost: { ...looks(LINK, "LOST"), word: "NOT CONNECTED" },
    denied: { shape: "locked", word: "token needed", tone: "warning" },
  };
  const look = page.standing !== null && page.state === "live" ? { ...states.lost, word: "STALLED" } : states[page.state];
  if (at("connection").textContent !== look.word) at("connection").replaceChildren(chip(look));
  const robot = page.robots.get(one.handle);
  if (wall.isWall) wall.tick(page.receivedStamp);
  else if (one.handle === null) fleet.age(page.robots.values());
  else if (robot) one.age(robot, live, seconds());
  warn();
  alarms.lost(at("banner").hidden ? null : "Nothing arrives from the gateway.");
  mark();
}

/** The marks of new alarms, and the title of the window. */
function mark() {
  const marked = alarms.marked();
  for (const [handle, { row }] of fleet.rows) row.classList.toggle("new", marked.has(handle));
  const robot = page.robots.get(one.handle);
  const words = robot ? one.title(robot) : fleet.errors ? `(${fleet.errors}!) RobotStatus` : "RobotStatus";
  const title = marked.size ? `\u25b2 NEW ${words}` : words;
  if (document.title !== title) document.title = title;
}

function warn() {
  const banner = at("banner");
  const lost = page.state === "lost";
  banner.hidden = !(lost || page.standing !== null) || page.state === "denied";
  if (banner.hidden) return;
  const since = page.receivedAt === null ? "" : ` since ${clock(page.receivedStamp)}, ${span(seconds() - page.receivedAt)} ago`;
  setText(banner, lost ? `No connection to the gateway${since}. Trying again.` : `The gateway has been stalled for ${span(page.standing)}. What it last said may be old.`);
}

function authorization() {
  const token = sessionStorage.getItem(TOKEN);
  return token === null ? {} : { Authorization: `Bearer ${token}` };
}

function route() {
  let handle = null;
  try {
    handle = decodeURIComponent(location.hash.replace(/^#\/?/, "")) || null;
  } catch {
    // an invalid link shows the fleet
  }
  if (handle?.startsWith("token=")) {
    sessionStorage.setItem(TOKEN, handle.slice(6));
    history.replaceState(null, "", "#/");
    handle = null;
  }
  page.list = location.hash === `#${LIST}`;
  page.wanted = page.list ? null : handle;
  const moved = stream !== null;
  if (!wall.isWall) one.open(wanted());
  connect();
  render();
  if (moved) {
    scrollTo(0, 0);
    at(one.handle === null ? "fleet-title" : "vehicle-title").focus({ preventScroll: true });
  }
}

function connect() {
  stream?.close();
  stream = new Stream(one.handle, authorization(), on);
}

at("token").addEventListener("submit", (event) => {
  event.preventDefault();
  sessionStorage.setItem(TOKEN, at("token-field").value.trim());
  page.state = "connecting";
  connect();
  render();
});
addEventListener("hashchange", route);
addEventListener("resize", () => (wall.isWall ? render() : one.handle === null && fleet.again()));
// a page that the browser keeps for its back button must not keep a connection
addEventListener("pagehide", () => stream.close());
addEventListener("pageshow", (event) => event.persisted && connect());
setInterval(age, 500);
route();
