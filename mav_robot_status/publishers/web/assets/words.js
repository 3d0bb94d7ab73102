// The look of each value: a word, a shape and a tone. The gateway makes `fields.js` from its one table of them.

import { LINK as LINK_ROW, ROBOT_STATES, SAID, STATES } from "./fields.js";

export { ROBOT_STATES };

const withLooks = (row) => ({ ...row, looks: new Map(row.looks) });

/** The fields of the gateway, in their order. */
export const FIELDS = STATES.map(withLooks);
export const LINK = withLooks(LINK_ROW);

/** The look of a field's value. Any value is allowed. */
export function looks(field, value) {
  return field.looks.get(value ?? null) ?? SAID.unknown;
}

/** The headline of a robot while nothing arrives about it, although its last status says otherwise. */
export function gone(headline, stamp) {
  const sentences = [{ text: SAID.last, at: stamp, rest: `: ${headline.word}` }, { text: SAID.may_move }];
  const unknown = ROBOT_STATES.find(({ shape }) => shape === SAID.unknown.shape);
  return { ...headline, ...unknown, sentences, step: "" };
}

/** `Last heard: AUTO`. */
export function lastKnown(look) {
  return `${SAID.last}: ${look.word}`;
}

/** When something was, as text: `now`, `14 s ago`. */
export function ago(seconds) {
  return seconds !== null && seconds < 2 ? "now" : `${span(seconds)} ago`;
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

/** A sentence of the gateway as plain text. */
export function plain({ text, at, quote, rest }) {
  const parts = [text, at ? clock(at) : "", quote ? `“${quote}”` : ""].filter((part) => part);
  return parts.join(" ") + (rest ?? "") + (text.endsWith(".") ? "" : ".");
}
