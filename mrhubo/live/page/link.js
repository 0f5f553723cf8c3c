// The WebSocket to the server: our messages, as docs/live.md specifies them, and what the robot does.

const VERSION = 1;
const HEARTBEAT_MS = 30; // the robot stops after a tenth of a second without one
const AGAIN_MS = 1000;
const MOST_WAITING = 16384; // bytes; where more wait, a frame is left out: the newest is what counts

export class Link {
  // told(message) is called with each message of the server, changed(connected) when a connection begins or ends.
  constructor(told, changed) {
    this.told = told;
    this.changed = changed;
    this.held = false;
    this.session = crypto.getRandomValues(new Uint32Array(2)).join("-");
    this.number = 0;
    this.connect();
    setInterval(() => this.beat(), HEARTBEAT_MS);
  }

  get open() { return this.socket.readyState === WebSocket.OPEN; }

  connect() {
    const token = new URLSearchParams(location.hash.slice(1)).get("token");
    const query = token ? "?token=" + encodeURIComponent(token) : "";
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    this.socket = new WebSocket(`${scheme}://${location.host}/live${query}`);
    this.socket.onopen = () => this.changed(true);
    this.socket.onclose = () => { this.changed(false); setTimeout(() => this.connect(), AGAIN_MS); };
    this.socket.onmessage = event => this.told(JSON.parse(event.data));
  }

  // Says at once whether the button is held, and again and again.
  hold(held) {
    if (held !== this.held) { this.held = held; this.beat(); }
  }

  beat() { this.send({kind: "heartbeat", held: this.held}, performance.now()); }

  // What is seen in a picture: 33 points [m], or nobody. `taken`: when the picture was taken [ms].
  see(points, taken) {
    if (!points) return this.send({kind: "nobody"}, taken);
    const rounded = value => Math.round(value * 1e5) / 1e5;
    return this.send({
      kind: "landmarks",
      set: "mediapipe",
      points: points.map(point => [point.x, point.y, point.z].map(rounded)),
      visibility: points.map(point => rounded(point.visibility ?? 0)),
    }, taken);
  }

  send(content, taken) {
    if (!this.open || this.socket.bufferedAmount > MOST_WAITING) return false;
    this.number += 1;
    this.socket.send(JSON.stringify(
      {mrhubo: VERSION, session: this.session, number: this.number, time: taken / 1000, ...content}));
    return true;
  }
}
