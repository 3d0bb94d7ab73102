// The last ten minutes of a vehicle as bands. The form shows the value: full height, half, a line, hatched for unknown.

import { clock, FIELDS, LINK, looks, span } from "./words.js";
import { draw, make } from "./make.js";

const WINDOW = 600; // s
const ROWS = [...FIELDS, LINK];
const FORMS = { full: [0, 20], half: [8, 12], line: [16, 4], hatched: [0, 20] };

/** The stretches of one field as [from, to, value], in seconds before now, oldest first. */
export function stretches(name, transitions, present, knownFor, dataUntil) {
  const own = transitions.filter((t) => t.name === name && t.ago < Math.min(knownFor, WINDOW) - 0.001);
  let from = Math.min(knownFor, WINDOW);
  let value = own.length ? own[0].before : present;
  const found = [];
  for (const t of own) {
    found.push([from, t.ago, value]);
    [from, value] = [t.ago, t.value];
  }
  found.push([from, dataUntil, value]);
  return found.filter(([a, b]) => a > b);
}

/** All bands; `now` is the time of the right edge as a Date. */
export function bands(line, history, dataUntil, now) {
  const rows = ROWS.map((field) => {
    const present = field === LINK ? line.link?.state : line[field.name];
    const drawing = draw("svg", { class: "band", role: "img" });
    const labels = [];
    for (const [from, to, value] of stretches(field.name, history.transitions, present ?? null, history.knownFor, dataUntil)) {
      const look = looks(field, value);
      const words = `${look.word} from ${clock(now - from * 1000)} for ${span(from - to)}`;
      labels.push(words);
      const rect = stretch(from, to, look);
      rect.append(draw("title", {}, `${field.title}: ${words}`));
      drawing.append(rect);
    }
    drawing.setAttribute("aria-label", `${field.title}: ${labels.slice(-5).join("; ") || "no data"}`);
    return make("div", { class: "row" }, make("span", {}, field.title), drawing);
  });
  const marks = [10, 8, 6, 4, 2].map((minutes) => make("span", {}, minutes === 10 ? "10 min" : `${minutes}`));
  const axis = make("div", { class: "row axis", "aria-hidden": "true" }, make("span"), make("div", {}, ...marks, make("span", {}, "now")));
  const key = make("p", { class: "note" }, "Full: yes, AUTO, or a lost link. Half: MANUAL. Line: no. Hatched: unknown. Empty: no data yet.");
  return [...rows, axis, key];
}

function stretch(from, to, { bar, tone }) {
  const [y, height] = FORMS[bar];
  const x = 100 * (1 - from / WINDOW);
  const width = Math.max((100 * (from - to)) / WINDOW, 0.25);
  return draw("rect", { x: `${x}%`, width: `${width}%`, y, height, class: `${bar} ${tone}` });
}
