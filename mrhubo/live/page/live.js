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
    const url = withToken("live"), token = url.searchParams.get("token");
    url.protocol = location.protocol === "https:" ? "wss:" : "ws:";
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
    if (!this.connected) return false;
    if (kind !== "heartbeat" && this.socket.bufferedAmount > MOST_WAITING) return false;
    this.number += 1;
    this.socket.send(JSON.stringify({ mrhubo: VERSION, session: this.session, number: this.number, time, kind, ...content }));
    return true;
  }

  beat() { this.send("heartbeat", { held: this.held }); }

  // Whether the button is held from now on: without a connection it is not.
  hold(held) {
    held = held && this.connected;
    if (held === this.held) return;
    this.held = held;
    this.beat();
  }

  get connected() { return this.socket.readyState === WebSocket.OPEN; }

  nobody(time) { return this.send("nobody", {}, time); }

  // points: [x, y, z] of these names, of a set that names its points; time as below.
  named(set, names, points, time) { return this.send("landmarks", { set, names, points }, time); }

  // points: 33 of MediaPipe's world landmarks {x, y, z, visibility}; time in seconds of performance.now()'s clock.
  landmarks(points, time) {
    if (!points) return this.nobody(time);
    return this.send("landmarks", {
      set: "mediapipe",
      points: points.map(({ x, y, z }) => [x, y, z]),
      visibility: points.map(({ visibility }) => visibility ?? 1),
    }, time);
  }
}

// An address of the server, with the token that the page's own address has behind its mark.
export function withToken(path) {
  const url = new URL(path, location.href), token = new URLSearchParams(location.hash.slice(1)).get("token");
  url.hash = "";
  if (token) url.searchParams.set("token", token);
  return url;
}

function isLoopback() {
  return ["localhost", "127.0.0.1", "[::1]"].includes(location.hostname);
}

const SPACE = (event) => event.code === "Space" || event.key === " "; // remote and virtual keyboards tell no code

// The button moves the robot while it is pressed, and so does the space bar; whatever takes the page's attention away lets go.
// Where a press does not count, or no more (it came before the connection, or the connection, the camera or the keyboard has
// gone since), the button says that it takes another one: a robot never begins to move because something comes back.
// Gives a function that lets go.
export function deadman(live, button) {
  const hint = button.querySelector("small"), usual = hint.textContent;
  let pressed = false; // whether a key or a pointer is down, as far as the page knows
  const show = () => {
    button.classList.toggle("held", live.held);
    button.classList.toggle("again", pressed && !live.held);
    button.setAttribute("aria-pressed", live.held);
    hint.textContent = !pressed && !document.hasFocus() ? "click on the page first: the keyboard is elsewhere"
      : pressed && !live.held ? "does not count: let go, and press again" : usual;
  };
  const press = () => { pressed = true; live.hold(true); show(); };
  const release = () => { pressed = false; live.hold(false); show(); };
  const drop = () => { live.hold(false); show(); };
  button.addEventListener("pointerdown", (event) => { press(); button.setPointerCapture(event.pointerId); });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(name, release);
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  addEventListener("keydown", (event) => {
    if (!SPACE(event)) return;
    event.preventDefault();
    if (!event.repeat) return press();
    pressed = true; // held since before the page could know
    show();
  });
  // Firefox clicks what has the focus when the space bar is let go of, whatever became of the press.
  addEventListener("keyup", (event) => { if (SPACE(event)) { event.preventDefault(); release(); } });
  addEventListener("blur", release);
  addEventListener("focus", show);
  addEventListener("pagehide", release);
  document.addEventListener("visibilitychange", () => { if (document.hidden) release(); });
  show();
  return drop;
}
