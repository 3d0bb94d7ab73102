// The last ten minutes of a vehicle as bands. The form shows the value: full height, half, a line, hatched for unknown.
// What is not kept is not drawn.

import { clock, FIELDS, LINK, looks, span } from "./words.js";
import { draw, make } from "./make.js";

const WINDOW = 600; // s
const ROWS = [...FIELDS, LINK];
const FORMS = { full: [0, 20], half: [8, 12], line: [16, 4], hatched: [0, 20] };

/** The stretches of one field as [from, to, value], in seconds before now, oldest first: none from before it was kept. */
export function stretches(name, transitions, present, keptFor, dataUntil) {
  const start = Math.min(keptFor, WINDOW);
  const own = transitions.filter((t) => t.name === name);
  const kept = own.filter((t) => t.ago < start - 0.001);
  let from = start;
  let value = kept.length ? kept[0].before : (own.at(-1)?.value ?? present);
  const found = [];
  for (const t of kept) {
    found.push([from, t.ago, value]);
    [from, value] = [t.ago, t.value];
  }
  found.push([from, dataUntil, value]);
  return found.filter(([a, b]) => a > b);
}

/** All bands; `keptFor` says for how many seconds each field is known, `now` is the time of the right edge. */
export function bands(line, transitions, keptFor, dataUntil, now) {
  const rows = ROWS.map((field) => {
    const present = field === LINK ? line.link?.state : line[field.name];
    const known = keptFor(field.name);
    const drawing = draw("svg", { class: "band", role: "img" });
    const labels = [];
    for (const [from, to, value] of stretches(field.name, transitions, present ?? null, known, dataUntil)) {
      const look = looks(field, value);
      const words = `${look.word} from ${clock(now - from * 1000)} for ${span(from - to)}`;
      labels.push(words);
      const rect = stretch(from, to, look);
      rect.append(draw("title", {}, `${field.title}: ${words}`));
      drawing.append(rect);
    }
    labels.splice(0, labels.length - 5);
    const label = make("div", {}, drawing);
    if (known < WINDOW - 1) {
      labels.unshift(`not kept before ${clock(now - known * 1000).slice(0, 5)}`);
      const note = make("small", { "aria-hidden": "true" }, labels[0]);
      note.style.right = `${(100 * known) / WINDOW}%`;
      if (known < WINDOW * 0.85) label.append(note);
      drawing.prepend(draw("title", {}, labels[0]));
    }
    drawing.setAttribute("aria-label", `${field.title}: ${labels.join("; ")}`);
    return make("div", { class: "row" }, make("span", {}, field.title), label);
  });
  const marks = [10, 8, 6, 4, 2].map((minutes) => make("span", {}, minutes === 10 ? "10 min" : `${minutes}`));
  const axis = make("div", { class: "row axis", "aria-hidden": "true" }, make("span"), make("div", {}, ...marks, make("span", {}, "now")));
  return [...rows, axis, legend()];
}

/** A sample of each form, with what it means. */
function legend() {
  const [program, pilot, unknown] = FIELDS.find(({ name }) => name === "mode").looks.values();
  const samples = [["full", "active", `yes, ${program.word}, a lost link`], ["half", "calm", pilot.word], ["line", "calm", "no"], ["hatched", "unknown", unknown.word]];
  const drawn = samples.map(([bar, tone, words]) => {
    const [y, height] = FORMS[bar];
    const drawing = draw("svg", { class: "band sample", "aria-hidden": "true" }, draw("rect", { width: "100%", y, height, class: `${bar} ${tone}` }));
    return make("span", {}, drawing, words);
  });
  return make("p", { class: "note legend" }, ...drawn, make("span", {}, "empty: not kept"));
}

function stretch(from, to, { bar, tone }) {
  const [y, height] = FORMS[bar];
  const x = 100 * (1 - from / WINDOW);
  const width = Math.max((100 * (from - to)) / WINDOW, 0.1);
  return draw("rect", { x: `${x}%`, width: `${width}%`, y, height, class: `${bar} ${tone}` });
}
