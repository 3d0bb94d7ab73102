// Alarms: each new error, stop and loss is marked and sounds once, until a person acknowledges it.

import { FIELDS, LINK, looks } from "./words.js";
import { isolated, make, setText } from "./make.js";
import { members, title } from "./robot.js";

const SHOWN = 5; // lines
const BEEP = 0.18; // s
const STOP = FIELDS.find(({ name }) => name === "e_stopped");
const PAGE = ""; // the handle of the page itself

/** What is wrong with a robot now, as [name, words]. A loss does not end an error. */
export function wrong(robot, before) {
  const found = new Map();
  if (!robot.heard()) {
    for (const [name, words] of before) if (name !== "lost") found.set(name, words);
    if (robot.line.link?.state !== "NEVER_SEEN") found.set("lost", looks(LINK, "LOST").word);
    return found;
  }
  if (robot.line.e_stopped === true) found.set("stopped", `${STOP.title}: ${looks(STOP, true).word}`);
  for (const cause of robot.said.causes) if (cause.list === "errors") found.set(`error ${cause.name} ${cause.handle ?? ""}`, cause.words);
  return found;
}

export class Alarms {
  constructor() {
    this.on = false;
    this.active = new Map();
    this.pending = new Map();
    this.sound = null;
    this.button = document.getElementById("sound");
    this.button.addEventListener("click", (event) => {
      event.stopPropagation();
      if (this.sound === null) this.unmute();
      else this.mute();
    });
    this.first = () => this.unmute();
    document.getElementById("acknowledge").addEventListener("click", () => this.acknowledge());
  }

  /** Turn the alarms on or off, as the gateway says. */
  enable(on) {
    if (on === this.on) return;
    this.on = on;
    if (on) document.addEventListener("click", this.first, { once: true });
    this.show();
  }

  /** Look at all robots, and at the page's own connection: `gone` are words, or null. */
  take(robots, gone) {
    if (!this.on) return;
    let news = false;
    const there = new Set(robots.map(({ line }) => line.handle));
    for (const robot of gone === null ? robots : []) {
      const { handle } = robot.line;
      if (members(robot.line).some((name) => there.has(name))) continue; // its members say it
      news = this.compare(handle, title(robot.line), wrong(robot, this.active.get(handle) ?? new Map())) || news;
    }
    if (gone === null) for (const handle of [...this.active.keys()]) if (handle !== PAGE && !there.has(handle)) this.active.delete(handle);
    news = this.compare(PAGE, "", gone === null ? new Map() : new Map([["gone", gone]])) || news;
    if (news) this.beep();
    if (news) this.show();
  }

  compare(handle, name, now) {
    const before = this.active.get(handle) ?? new Map();
    let news = false;
    for (const [what, words] of now) {
      if (before.has(what)) continue;
      this.pending.set(`${handle}\n${what}`, { handle, name, words, at: new Date() });
      news = true;
    }
    this.active.set(handle, now);
    return news;
  }

  /** A person has seen what is marked, of one robot or of all. */
  acknowledge(handle = null) {
    for (const [key, one] of this.pending) if (handle === null || one.handle === handle) this.pending.delete(key);
    this.show();
  }

  /** The robots with a mark. */
  marked() {
    return new Set([...this.pending.values()].map(({ handle }) => handle));
  }

  show() {
    document.getElementById("alarms").hidden = this.pending.size === 0;
    const newest = [...this.pending.values()].reverse();
    const items = newest.slice(0, SHOWN).map((one) => this.item(one));
    if (newest.length > SHOWN) items.push(make("li", {}, `and ${newest.length - SHOWN} more`));
    document.getElementById("alarm-list").replaceChildren(...items);
    this.button.hidden = !this.on;
    setText(this.button, this.sound ? "Sound on" : "Sound off: click once to turn it on");
    this.button.setAttribute("aria-pressed", `${this.sound !== null}`);
  }

  item({ handle, name, words, at }) {
    const when = make("time", { datetime: at.toISOString() }, at.toLocaleTimeString([], { hourCycle: "h23" }));
    const text = make("span", {}, make("b", {}, "NEW "), when, " ", isolated(name), name ? ": " : "", isolated(words));
    const button = make("button", { type: "button", class: "plain", "aria-label": `Acknowledge ${name || "the page"}` }, "Acknowledge");
    button.addEventListener("click", () => this.acknowledge(handle));
    return make("li", {}, text, button);
  }

  /** Browsers allow sound after a click. */
  unmute() {
    document.removeEventListener("click", this.first);
    this.sound = new AudioContext();
    this.sound.resume();
    this.beep();
    this.show();
  }

  mute() {
    this.sound.close();
    this.sound = null;
    this.show();
  }

  beep() {
    if (this.sound === null) return;
    const { currentTime, destination } = this.sound;
    for (const [delay, pitch] of [[0, 880], [BEEP * 1.4, 660]]) {
      const tone = this.sound.createOscillator();
      const volume = this.sound.createGain();
      tone.frequency.value = pitch;
      volume.gain.value = 0.2;
      tone.connect(volume).connect(destination);
      tone.start(currentTime + delay);
      tone.stop(currentTime + delay + BEEP);
    }
  }
}
