// Elements. Whatever comes from a vehicle becomes text, never markup.

const SVG = "http://www.w3.org/2000/svg";

/** An element with attributes and children; strings become text. */
export function make(tag, attributes = {}, ...children) {
  return fill(document.createElement(tag), attributes, children);
}

/** The same for SVG. */
export function draw(tag, attributes = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), attributes, children);
}

/** Text of a vehicle's: its direction does not spill over. */
export function said(text) {
  return make("bdi", {}, String(text));
}

/** A shape of the sprite; the word beside it tells the same. */
export function shape(name) {
  return draw("svg", { class: "shape", "aria-hidden": "true" }, draw("use", { href: `#${name}` }));
}

/** Shape and word of a value. */
export function chip({ shape: name, word, tone }) {
  return make("span", { class: `chip ${tone}` }, shape(name), make("span", {}, word));
}

/** Set text only where it differs: whoever selects or listens is not disturbed. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}
