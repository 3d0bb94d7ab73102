// The page: it holds the data of the gateway, and shows the fleet or one vehicle.

import { Fleet } from "./fleet.js";
import { Stream } from "./stream.js";
import { VehiclePage } from "./vehicle.js";
import { chip, setText } from "./make.js";
import { clock, span } from "./words.js";

const TOKEN = "mav-robot-status token";
const at = (id) => document.getElementById(id);
const seconds = () => performance.now() / 1000;

/** The latest status of one handle, and its time of arrival. */
class Vehicle {
  constructor(line) {
    this.setLine(line);
  }

  setLine(line) {
    this.line = line;
    this.heartbeat(line.stamp, line.link?.heartbeat_age ?? null, 0);
  }

  heartbeat(stamp, heartbeatAge, age) {
    Object.assign(this, { stamp, heartbeatAge, age, at: seconds() });
  }

  currentAge() {
    return this.heartbeatAge === null ? null : this.heartbeatAge + this.age + seconds() - this.at;
  }

  stale() {
    return page.staleAfter !== null && this.age + seconds() - this.at > page.staleAfter;
  }
}

const page = { vehicles: new Map(), state: "connecting", receivedAt: null, receivedStamp: null, standing: null, staleAfter: null };
const fleet = new Fleet();
const one = new VehiclePage();
let stream = null;

const on = {
  event(name, data) {
    const now = seconds();
    if (name === "history") return data.handle === one.handle && (one.take(data, now), render());
    if (name === "explanation") return data.handle === one.handle && one.explain(data);
    [page.state, page.receivedAt, page.receivedStamp, page.standing] = ["live", now, data.now, data.standing];
    if (name === "board") {
      page.vehicles.clear();
      page.staleAfter = data.stale_after;
      setText(at("source"), `${data.source}`);
      at("source").title = `mav-robot-status ${data.version}`;
    }
    for (const line of data.vehicles) {
      const known = page.vehicles.get(line.handle);
      if (known) known.setLine(line);
      else page.vehicles.set(line.handle, new Vehicle(line));
    }
    for (const [handle, beat] of Object.entries(data.beats ?? {})) page.vehicles.get(handle)?.heartbeat(...beat);
    // `beats` names every vehicle that the gateway has
    if (data.beats) for (const handle of [...page.vehicles.keys()]) if (!(handle in data.beats)) page.vehicles.delete(handle);
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

function ordered() {
  const key = ({ line }) => [line.system ?? Infinity, line.component ?? 0];
  return [...page.vehicles.values()].sort((a, b) => {
    const [x, y] = [key(a), key(b)];
    return x[0] - y[0] || x[1] - y[1] || (a.line.handle < b.line.handle ? -1 : 1);
  });
}

function render() {
  const denied = page.state === "denied";
  const vehicle = page.vehicles.get(one.handle);
  at("token").hidden = !denied;
  at("fleet").hidden = denied || one.handle !== null || page.receivedAt === null;
  at("vehicle").hidden = denied || one.handle === null || page.receivedAt === null;
  if (one.handle === null) fleet.show(ordered());
  else if (vehicle) one.show(vehicle);
  else setText(at("who"), "The gateway has no such vehicle.");
  age();
}

function age() {
  const live = page.state === "live" && page.standing === null;
  document.body.classList.toggle("stale", page.state === "lost" || page.standing !== null);
  const looks = {
    live: { shape: "bars", word: "live", tone: "calm" },
    connecting: { shape: "ring", word: "connecting …", tone: "unknown" },
    lost: { shape: "lost", word: "NOT CONNECTED", tone: "danger" },
    denied: { shape: "bar", word: "token needed", tone: "caution" },
  };
  const look = page.standing !== null && page.state === "live" ? { ...looks.lost, word: "STALLED" } : looks[page.state];
  if (at("connection").textContent !== look.word) at("connection").replaceChildren(chip(look));
  const vehicle = page.vehicles.get(one.handle);
  if (one.handle === null) fleet.age(page.vehicles.values());
  else if (vehicle) one.age(vehicle, live, seconds());
  warn();
}

function warn() {
  const banner = at("banner");
  const lost = page.state === "lost";
  banner.hidden = !(lost || page.standing !== null) || page.state === "denied";
  if (banner.hidden) return;
  const since = page.receivedAt === null ? "" : ` since ${clock(page.receivedStamp)}, ${span(seconds() - page.receivedAt)} ago. The data shown is from then`;
  setText(banner, lost ? `No connection to the gateway${since}. Trying again.` : `The gateway has been stalled for ${span(page.standing)}. The data shown may be old.`);
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
  const moved = stream !== null;
  one.open(handle);
  connect();
  render();
  if (moved) {
    scrollTo(0, 0);
    at(handle === null ? "fleet-title" : "vehicle-title").focus({ preventScroll: true });
  }
}

function connect() {
  stream?.close();
  stream = new Stream(one.handle, sessionStorage.getItem(TOKEN), on);
}

at("token").addEventListener("submit", (event) => {
  event.preventDefault();
  sessionStorage.setItem(TOKEN, at("token-field").value.trim());
  page.state = "connecting";
  connect();
  render();
});
addEventListener("hashchange", route);
setInterval(age, 500);
route();
