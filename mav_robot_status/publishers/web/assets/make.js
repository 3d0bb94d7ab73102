// Creates elements. Text from a vehicle becomes a text node, never markup.

import { clock } from "./words.js";

const SVG = "http://www.w3.org/2000/svg";

/** An element with attributes and children; strings become text. */
export function make(tag, attributes = {}, ...children) {
  return fill(document.createElement(tag), attributes, children);
}

/** An SVG element with attributes and children. */
export function draw(tag, attributes = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), attributes, children);
}

/** Text from a vehicle. Its writing direction does not affect other text. */
export function isolated(text) {
  return make("bdi", {}, String(text));
}

/** A shape of the sprite. A word beside it has the same meaning. */
export function shape(name) {
  return draw("svg", { class: "shape", "aria-hidden": "true" }, draw("use", { href: `#${name}` }));
}

/** Shape and word of a value. */
export function chip(look) {
  return turn(make("span", {}, shape(look.shape), make("span")), look);
}

/** Let a chip show another look; what is the same stays. */
export function turn(made, { shape: name, word, tone }) {
  const [drawing, text] = made.children;
  const use = drawing.firstChild;
  if (use.getAttribute("href") !== `#${name}`) use.setAttribute("href", `#${name}`);
  setText(text, word);
  if (made.className !== `chip ${tone}`) made.className = `chip ${tone}`;
  return made;
}

/** Sentences of the gateway. The words of the autopilot are quoted, and nothing in them affects other text. */
export function told(sentences) {
  return sentences.flatMap(({ text, at, quote, rest }, n) => {
    const parts = [n ? " " : "", isolated(text)];
    if (at) parts.push(" ", make("time", { datetime: at }, clock(at)));
    if (quote) parts.push(" “", isolated(quote), "”");
    return [...parts, rest ?? "", text.endsWith(".") ? "" : "."];
  });
}

/** Set the text if it differs. This keeps a selection, and screen readers repeat nothing. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}
