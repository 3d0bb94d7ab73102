// The events of all robots, and those that wait for a person: the gateway keeps both, so that they are the same in each
// browser. Only the loss of the gateway itself is known here alone.

import { chip, isolated, make, setText } from "./make.js";
import { clock } from "./words.js";

const SHOWN = 5; // lines
const KEPT = 200; // events
const EVERY = 1000; // ms between two drawings of the events
const BEEP = 0.18; // s
const at = (id) => document.getElementById(id);

export class Alarms {
  /** `send(handle)` tells the gateway that a person has seen the alarms of a robot, or of all (null). */
  constructor(send) {
    this.send = send;
    this.on = false;
    this.pending = [];
    this.news = [];
    this.gone = null; // the loss of the gateway: [words, time, whether a person has seen it]
    this.sound = null;
    this.button = at("sound");
    this.button.addEventListener("click", (event) => {
      event.stopPropagation();
      if (this.sound === null) this.unmute();
      else this.mute();
    });
    this.first = () => this.unmute();
    at("acknowledge").addEventListener("click", () => this.acknowledge());
  }

  /** Turn the alarms on or off, as the gateway says. A gateway that began anew has other events. */
  enable(on) {
    at("log").replaceChildren();
    this.pending = [];
    this.news = [];
    if (on && !this.on) document.addEventListener("click", this.first, { once: true });
    this.on = on;
    this.show();
  }

  /** New events, and all that wait for a person; either may be absent. */
  take(events = [], pending = null) {
    this.news = [...this.news, ...events].slice(-KEPT);
    if (this.news.length && !this.timer) {
      this.list();
      this.timer = setTimeout(() => {
        this.timer = null;
        this.list();
      }, EVERY);
    }
    if (pending) this.pending = pending;
    if (!this.on || !pending) return;
    if (events.some((one) => one.what === "begins" && this.pending.some((other) => other.version === one.version))) this.beep();
    this.show();
  }

  /** Add the news to the list of events. */
  list() {
    const log = at("log");
    log.prepend(...this.news.map(item).reverse());
    this.news = [];
    while (log.childElementCount > KEPT) log.lastChild.remove();
    at("events").hidden = log.childElementCount === 0;
  }

  /** Whether nothing arrives from the gateway: words, or null. */
  lost(words) {
    if (!this.on || (words === null) === (this.gone === null)) return;
    this.gone = words === null ? null : [words, new Date(), false];
    if (words !== null) this.beep();
    this.show();
  }

  acknowledge(handle = null) {
    if (handle === null && this.gone) this.gone[2] = true;
    this.send(handle);
    this.show();
  }

  /** The robots with a mark. */
  marked() {
    return new Set(this.on ? this.pending.map(({ handle }) => handle) : []);
  }

  show() {
    const gone = this.gone !== null && !this.gone[2];
    at("alarms").hidden = !this.on || !(this.pending.length || gone);
    const newest = [...this.pending].reverse();
    const items = newest.slice(0, SHOWN).map((one) => waiting(one, () => this.acknowledge(one.handle)));
    if (gone) items.unshift(this.page());
    if (newest.length > SHOWN) items.push(make("li", {}, `and ${newest.length - SHOWN} more`));
    at("alarm-list").replaceChildren(...items);
    this.button.hidden = !this.on;
    setText(this.button, this.sound ? "Sound on" : "Sound off: click once to turn it on");
    this.button.setAttribute("aria-pressed", `${this.sound !== null}`);
  }

  /** The line of a lost gateway. It cannot keep that a person has seen this. */
  page() {
    const button = make("button", { type: "button", class: "plain" }, "Acknowledge in this browser only");
    button.addEventListener("click", () => {
      this.gone[2] = true;
      this.show();
    });
    return make("li", {}, make("span", {}, make("b", {}, "NEW "), clock(this.gone[1]), " ", this.gone[0]), button);
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

/** Time, robot, state and cause of an event. */
function told({ stamp, name, word, shape, tone, what, why }) {
  const ended = what === "begins" ? tone : "calm";
  const words = what === "acknowledged" ? `${why} (acknowledged)` : why;
  return [make("time", { datetime: stamp }, clock(stamp)), " ", isolated(name), " ", chip({ shape, word, tone: ended }), " ", isolated(words)];
}

function item(event) {
  return make("li", { class: event.what }, ...told(event));
}

function waiting(event, acknowledge) {
  const button = make("button", { type: "button", class: "plain", "aria-label": `Acknowledge ${event.name}` }, "Acknowledge");
  button.addEventListener("click", acknowledge);
  return make("li", {}, make("span", {}, make("b", {}, "NEW "), ...told(event)), button);
}
