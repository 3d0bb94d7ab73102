// A wall to be read from five metres: the counts, then the robots in trouble, the worst first, as many as fit.

import { counted, left, number, sorted } from "./fleet.js";
import { chip, make, setText, shape, told } from "./make.js";
import { title } from "./robot.js";
import { clock, ROBOT_STATES } from "./words.js";

const MOST = 60; // robots that are tried
const TROUBLE = 7; // the rank of the first state that is none
const at = (id) => document.getElementById(id);

/** Whether the address asks for the wall. */
export const isWall = /\/wall\/?$/.test(location.pathname) || new URLSearchParams(location.search).has("wall");

/** Show these robots. */
export function show(robots, leftOut) {
  const single = counted(robots);
  const count = (state) => single.filter((robot) => robot.headline().word === state.word).length;
  const counts = ROBOT_STATES.map((state) => [state, count(state)]).filter(([, found]) => found);
  const chips = counts.map(([state, found]) => chip({ ...state, word: `${found} ${state.word}` }));
  at("wall-counts").replaceChildren(make("strong", {}, number(single.length)), ...chips);
  setText(at("wall-left-out"), left(leftOut));
  const ordered = sorted(single).filter((robot) => robot.headline().rank < TROUBLE);
  const cards = ordered.slice(0, MOST).map(card);
  at("wall-robots").replaceChildren(...cards);
  at("wall-none").hidden = ordered.length > 0 || single.length === 0;
  fit(cards, ordered.length);
}

/** Nothing is below the edge: what does not fit is a number. */
function fit(cards, all) {
  const rest = at("wall-rest");
  setText(rest, all ? `and ${all} more` : "");
  const edge = innerHeight - rest.getBoundingClientRect().height - 8;
  const below = cards.filter((one) => one.getBoundingClientRect().bottom > edge);
  for (const one of below) one.remove();
  const hidden = all - cards.length + below.length;
  setText(rest, hidden ? `and ${hidden} more` : "");
}

function card(robot) {
  const headline = robot.headline();
  const word = make("p", { class: "word" }, shape(headline.shape), make("strong", {}, headline.word));
  const why = make("p", { class: "told" }, ...told(headline.sentences.slice(0, 2)));
  return make("li", { class: headline.tone }, word, make("p", { class: "name" }, title(robot.line)), why);
}

/** The time of the gateway. It stands still when the page or the gateway is dead. */
export function tick(stamp) {
  if (stamp !== null) setText(at("wall-clock"), clock(stamp));
}
