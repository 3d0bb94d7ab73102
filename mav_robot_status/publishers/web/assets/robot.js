// One robot as the page has it: its last line, what the gateway says of it, and how old that is.

import { gone } from "./words.js";

const seconds = () => performance.now() / 1000;
const NOTHING = { word: "", shape: "unknown", tone: "unknown", rank: 0, sentences: [], step: "", topic: "" };

export class Robot {
  constructor(line) {
    this.frozen = null;
    this.staleAfter = null;
    this.said = NOTHING;
    this.about = { causes: [], last: null };
    this.set(line);
  }

  /** What the gateway says of it. */
  say(headline) {
    this.said = headline;
  }

  /** Its causes, and what was known before its link was lost. The page of one robot has them. */
  tell(about) {
    this.about = about;
  }

  /** A new line. */
  set(line) {
    this.line = line;
    this.heartbeat(line.stamp, line.link?.heartbeat_age ?? null, 0);
  }

  heartbeat(stamp, heartbeatAge, age) {
    Object.assign(this, { stamp, heartbeatAge, age, at: seconds() });
  }

  /** Seconds since the last heartbeat; null if there was none. */
  currentAge() {
    return this.heartbeatAge === null ? null : this.heartbeatAge + this.age + seconds() - this.at;
  }

  /** Whether nothing new arrives about this robot, or about any robot. */
  stale() {
    return this.frozen !== null || (this.staleAfter !== null && this.age + seconds() - this.at > this.staleAfter);
  }

  heard() {
    return this.line.link?.state === "CONNECTED" && !this.stale();
  }

  /** What to say of it now. */
  headline() {
    return this.stale() && this.line.link?.state === "CONNECTED" ? gone(this.said, this.stamp) : this.said;
  }

  /** The value of a field now; undefined: unknown, because nothing arrives. */
  value(name) {
    return this.stale() ? undefined : this.line[name];
  }

  /** The last known value of a field; undefined while it is heard, or if there was none. */
  last(name) {
    if (this.line.link?.state !== "CONNECTED") return this.about.last?.[name];
    return this.stale() ? this.line[name] : undefined;
  }
}

/** The handles of the members of a group; empty for a single robot. */
export function members(line) {
  return Array.isArray(line.members) ? line.members.map(String) : [];
}

/** The title of a robot: its name, its handle, or its system id for a default handle. */
export function title(line) {
  if (typeof line.vehicle?.name === "string" && line.vehicle.name) return line.vehicle.name;
  const handle = String(line.handle ?? "?");
  if (!/^industrial_robot_status_handle(\/\d+\.\d+)?$/.test(handle)) return handle;
  return line.system === null || line.system === undefined ? handle : `System ${line.system}`;
}

/** The ids, or the members of a group. */
export function ids(line) {
  if (members(line).length) return `group of ${members(line).join(", ")}`;
  return line.system === null || line.system === undefined ? "" : `${line.system}.${line.component}`;
}

/** Ids, autopilot with its firmware, and type in one line; for a group its members. */
export function kind(line) {
  if (members(line).length) return ids(line);
  const autopilot = [line.vehicle?.autopilot, line.vehicle?.firmware].filter((part) => part).join(" ");
  return [ids(line), autopilot, line.vehicle?.type].filter((part) => part).join(" · ");
}
