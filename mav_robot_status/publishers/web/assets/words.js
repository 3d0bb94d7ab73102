// The look of each value: a shape, a word and a tone. The tone is never the only difference.

import { STATES } from "./fields.js"; // the gateway generates it from its table of fields

const unknown = { shape: "unknown", word: "UNKNOWN", tone: "unknown" };
const calm = (shape, word) => ({ shape, word, tone: "calm" });

const LOOKS = [
  { name: "mode", head: "Mode", title: "Who is in charge" },
  { name: "motion_possible", head: "Motion possible", title: "Motion possible",
    yes: { shape: "yes", word: "YES", tone: "good" }, no: { shape: "bar", word: "NO", tone: "caution" } },
  { name: "in_motion", head: "In motion", title: "In motion",
    yes: { shape: "move", word: "MOVING", tone: "active" }, no: calm("still", "still") },
  { name: "drives_powered", head: "Drives", title: "Drives powered",
    yes: { shape: "power", word: "POWERED", tone: "caution" }, no: calm("ring", "off") },
  { name: "e_stopped", head: "E-stop", title: "Emergency stop",
    yes: { shape: "stop", word: "STOPPED", tone: "danger" }, no: calm("ring", "no") },
  { name: "in_error", head: "Error", title: "Error",
    yes: { shape: "error", word: "ERROR", tone: "danger" }, no: calm("ring", "none") },
];

const plain = ({ name }) => {
  const words = name[0].toUpperCase() + name.slice(1).replaceAll("_", " ");
  return { name, head: words, title: words, yes: calm("yes", "YES"), no: calm("ring", "no") };
};

/** The fields of the gateway: those above in their order, then those without an entry above. */
export const FIELDS = [...LOOKS, ...STATES.filter(({ name }) => !LOOKS.some((look) => look.name === name)).map(plain)];

const MODES = {
  AUTO: { shape: "auto", word: "AUTO", tone: "active" },
  MANUAL: { shape: "manual", word: "MANUAL", tone: "plain" },
};

const LINKS = {
  CONNECTED: { shape: "bars", word: "connected", tone: "calm" },
  LOST: { shape: "lost", word: "LOST", tone: "danger" },
  NEVER_SEEN: { shape: "unknown", word: "NEVER SEEN", tone: "unknown" },
};

export const LINK = { name: "link", head: "Link", title: "Link" };

/** The look of a field's value. Any value is allowed. */
export function looks(field, value) {
  if (field.name === "mode") return Object.hasOwn(MODES, value) ? MODES[value] : unknown;
  if (field.name === "link") return Object.hasOwn(LINKS, value) ? LINKS[value] : unknown;
  return value === true ? field.yes : value === false ? field.no : unknown;
}

/** The verdict: one large word for a person beside the robot. */
export function verdict(line) {
  if (line.link?.state !== "CONNECTED") return { shape: "lost", word: "NO LINK", tone: "unknown", detail: "Its state is unknown. It may move." };
  if (line.in_motion === true) return { shape: "move", word: "MOVING", tone: "active", detail: charge(line) };
  if (line.e_stopped === true) return { shape: "stop", word: "EMERGENCY STOP", tone: "danger", detail: charge(line) };
  if (line.motion_possible === true) return { shape: "power", word: "MOTION POSSIBLE", tone: "caution", detail: charge(line) };
  if (line.motion_possible === false) return { shape: "bar", word: "MOTION NOT POSSIBLE", tone: "plain", detail: charge(line) };
  return { shape: "unknown", word: "UNKNOWN", tone: "unknown", detail: "It is unknown whether it can move. " + charge(line) };
}

function charge(line) {
  const mode = line.vehicle?.flight_mode ? ` (${line.vehicle.flight_mode})` : "";
  if (line.mode === "AUTO") return `A program is in charge${mode}.`;
  if (line.mode === "MANUAL") return `A person is in charge${mode}.`;
  return `It is unknown who is in charge${mode}.`;
}

/** `12:03:04` of a stamp or a Date, in the reader's time zone. */
export function clock(time) {
  const date = new Date(time);
  return Number.isNaN(date.getTime()) ? "?" : date.toLocaleTimeString([], { hourCycle: "h23" });
}

/** A duration as text: `< 2 s`, `14 s`, `3 min 12 s`, `2 h 5 min`. */
export function span(seconds) {
  if (typeof seconds !== "number" || !(seconds >= 0)) return "?";
  if (seconds < 2) return "< 2 s";
  if (seconds < 100) return `${Math.floor(seconds)} s`;
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min ${Math.floor(seconds % 60)} s`;
  return `${Math.floor(seconds / 3600)} h ${Math.floor((seconds % 3600) / 60)} min`;
}
