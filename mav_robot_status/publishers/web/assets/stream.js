// The event stream. It uses fetch: EventSource can neither send a token nor report why it failed.

const SILENCE = 3500; // ms without data after which the stream is reopened; the gateway sends at least once a second
const RETRY = 1000; // ms

/** Follows the stream until `close`; `on` has open(), event(name, data), lost(), denied(). */
export class Stream {
  constructor(handle, headers, on) {
    this.query = handle === null ? "" : `?handle=${encodeURIComponent(handle)}`;
    this.headers = headers;
    this.on = on;
    this.closed = false;
    this.follow();
  }

  close() {
    this.closed = true;
    this.abort?.abort();
    clearTimeout(this.timer);
  }

  async follow() {
    this.abort = new AbortController();
    this.listen();
    try {
      const answer = await fetch(`events${this.query}`, { headers: this.headers, signal: this.abort.signal, cache: "no-store" });
      if (answer.status === 401) {
        if (!this.closed) this.on.denied();
        this.close();
      } else if (answer.ok) {
        await this.read(answer.body.pipeThrough(new TextDecoderStream()).getReader());
      }
    } catch (error) {
      if (!(error instanceof TypeError || error instanceof DOMException)) console.error(error);
    }
    clearTimeout(this.timer);
    if (this.closed) return;
    this.on.lost();
    this.timer = setTimeout(() => this.follow(), RETRY);
  }

  listen() {
    clearTimeout(this.timer);
    const abort = this.abort;
    this.timer = setTimeout(() => abort.abort(), SILENCE);
  }

  async read(reader) {
    let rest = "";
    for (;;) {
      const { value, done } = await reader.read();
      if (done || this.closed) return;
      this.listen();
      const events = (rest + value).split("\n\n");
      rest = events.pop();
      for (const text of events) this.take(text);
    }
  }

  take(text) {
    const lines = text.split("\n");
    const name = lines.find((line) => line.startsWith("event: "))?.slice(7);
    const data = lines.find((line) => line.startsWith("data: "))?.slice(6);
    if (name && data) this.on.event(name, JSON.parse(data));
  }
}
