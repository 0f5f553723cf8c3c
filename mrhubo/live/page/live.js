// The connection to a live session: docs/live.md specifies its messages. Pages import `Live`.

const VERSION = 1;
const BEAT_MS = 25; // the session stops the robot when nothing has come for its heartbeat_timeout, 100 ms by default
const RETRY_MS = 1000;
const MOST_WAITING = 20_000; // bytes; a frame is left out rather than sent late

export class Live {
  // on: {joints(message), open(), closed(reason)}
  constructor(on = {}) {
    this.on = on;
    this.session = crypto.getRandomValues(new Uint32Array(3)).join("-");
    this.number = 0;
    this.held = false;
    this.connect();
    setInterval(() => { if (this.held) this.beat(); }, BEAT_MS);
  }

  connect() {
    const url = new URL("live", location.href);
    url.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    url.hash = "";
    const token = new URLSearchParams(location.hash.slice(1)).get("token");
    if (token) url.searchParams.set("token", token);
    this.socket = new WebSocket(url);
    this.socket.onopen = () => this.on.open?.();
    this.socket.onmessage = (event) => {
      const message = JSON.parse(event.data);
      if (message.mrhubo === VERSION && message.kind === "joints") this.on.joints?.(message);
    };
    this.socket.onclose = () => {
      this.held = false;
      this.on.closed?.(token || isLoopback() ? "the session has ended, or is not there" : "the address lacks its token");
      setTimeout(() => this.connect(), RETRY_MS);
    };
  }

  // One message; false where it was left out.
  send(kind, content, time = performance.now() / 1000) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    if (kind !== "heartbeat" && this.socket.bufferedAmount > MOST_WAITING) return false;
    this.number += 1;
    this.socket.send(JSON.stringify({ mrhubo: VERSION, session: this.session, number: this.number, time, kind, ...content }));
    return true;
  }

  beat() { this.send("heartbeat", { held: this.held }); }

  hold(held) {
    if (held === this.held) return;
    this.held = held && this.socket.readyState === WebSocket.OPEN;
    this.beat();
  }

  // points: 33 of MediaPipe's world landmarks {x, y, z, visibility}; time in seconds of performance.now()'s clock.
  landmarks(points, time) {
    if (!points) return this.send("nobody", {}, time);
    return this.send("landmarks", {
      set: "mediapipe",
      points: points.map(({ x, y, z }) => [x, y, z]),
      visibility: points.map(({ visibility }) => visibility ?? 1),
    }, time);
  }
}

function isLoopback() {
  return ["localhost", "127.0.0.1", "[::1]"].includes(location.hostname);
}

// The button moves the robot while it is pressed, and so does the space bar; whatever takes the page's attention away lets go.
export function deadman(live, button) {
  const set = (held) => { live.hold(held); button.classList.toggle("held", live.held); button.setAttribute("aria-pressed", live.held); };
  button.addEventListener("pointerdown", (event) => { button.setPointerCapture(event.pointerId); set(true); });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(name, () => set(false));
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  addEventListener("keydown", (event) => { if (event.code === "Space") { event.preventDefault(); if (!event.repeat) set(true); } });
  addEventListener("keyup", (event) => { if (event.code === "Space") set(false); });
  addEventListener("blur", () => set(false));
  addEventListener("pagehide", () => set(false));
  document.addEventListener("visibilitychange", () => { if (document.hidden) set(false); });
  return set;
}
