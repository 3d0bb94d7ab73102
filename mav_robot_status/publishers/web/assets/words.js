// How each value is shown: a shape, a word and a tone. The tone is never all there is.

const unknown = { shape: "unknown", word: "UNKNOWN", tone: "unknown" };
const calm = (shape, word) => ({ shape, word, tone: "calm" });

export const FIELDS = [
  { name: "mode", head: "Mode", ask: "Who is in charge" },
  { name: "motion_possible", head: "Motion possible", ask: "Motion possible",
    yes: { shape: "yes", word: "YES", tone: "good" }, no: { shape: "bar", word: "NO", tone: "caution" } },
  { name: "in_motion", head: "In motion", ask: "In motion",
    yes: { shape: "move", word: "MOVING", tone: "active" }, no: calm("still", "still") },
  { name: "drives_powered", head: "Drives", ask: "Drives powered",
    yes: { shape: "power", word: "POWERED", tone: "caution" }, no: calm("ring", "off") },
  { name: "e_stopped", head: "E-stop", ask: "Emergency stop",
    yes: { shape: "stop", word: "STOPPED", tone: "danger" }, no: calm("ring", "no") },
  { name: "in_error", head: "Error", ask: "Error",
    yes: { shape: "error", word: "ERROR", tone: "danger" }, no: calm("ring", "none") },
];

const MODES = {
  AUTO: { shape: "auto", word: "AUTO", tone: "active" },
  MANUAL: { shape: "manual", word: "MANUAL", tone: "plain" },
};

const LINKS = {
  CONNECTED: { shape: "heard", word: "heard", tone: "calm" },
  LOST: { shape: "lost", word: "LOST", tone: "danger" },
  NEVER_SEEN: { shape: "unknown", word: "NEVER SEEN", tone: "unknown" },
};

export const LINK = { name: "link", head: "Link", ask: "Link" };

/** How a field's value is shown; whatever the value is. */
export function looks(field, value) {
  if (field.name === "mode") return Object.hasOwn(MODES, value) ? MODES[value] : unknown;
  if (field.name === "link") return Object.hasOwn(LINKS, value) ? LINKS[value] : unknown;
  return value === true ? field.yes : value === false ? field.no : unknown;
}

/** The state in large, for somebody who stands beside the robot. */
export function verdict(line) {
  if (line.link?.state !== "CONNECTED") return { shape: "lost", word: "NOT HEARD", tone: "unknown", says: "Nothing is known of it now. It may move." };
  if (line.in_motion === true) return { shape: "move", word: "MOVING", tone: "active", says: charge(line) };
  if (line.e_stopped === true) return { shape: "stop", word: "EMERGENCY STOP", tone: "danger", says: charge(line) };
  if (line.motion_possible === true) return { shape: "power", word: "MOTION POSSIBLE", tone: "caution", says: charge(line) };
  if (line.motion_possible === false) return { shape: "bar", word: "MOTION NOT POSSIBLE", tone: "plain", says: charge(line) };
  return { shape: "unknown", word: "UNKNOWN", tone: "unknown", says: "It is not known whether it can move. " + charge(line) };
}

function charge(line) {
  const mode = line.vehicle?.flight_mode ? ` (${line.vehicle.flight_mode})` : "";
  if (line.mode === "AUTO") return `A program is in charge${mode}.`;
  if (line.mode === "MANUAL") return `A person is in charge${mode}.`;
  return `It is not known who is in charge${mode}.`;
}

/** `12:03:04` of a stamp or a Date, in the time of whoever reads. */
export function clock(time) {
  const date = new Date(time);
  return Number.isNaN(date.getTime()) ? "?" : date.toLocaleTimeString([], { hourCycle: "h23" });
}

/** A duration for reading: `< 2 s`, `14 s`, `3 min 12 s`, `2 h 5 min`. */
export function span(seconds) {
  if (typeof seconds !== "number" || !(seconds >= 0)) return "?";
  if (seconds < 2) return "< 2 s";
  if (seconds < 100) return `${Math.floor(seconds)} s`;
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min ${Math.floor(seconds % 60)} s`;
  return `${Math.floor(seconds / 3600)} h ${Math.floor((seconds % 3600) / 60)} min`;
}
