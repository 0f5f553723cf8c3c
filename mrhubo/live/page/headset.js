// A headset's part of a live page: the body that its browser tracks, by WebXR's body tracking
// (https://immersive-web.github.io/body-tracking), goes to the session, and a controller's trigger or grip is the button.

const BEAT_MS = 20; // pages may sleep while a headset shows a session, and their timers with them
const MODES = ["immersive-ar", "immersive-vr"]; // the room around the person, where the headset can show it
// What the wearer sees beside the room: nothing; held, the robot may move; pressed, and it does not count; no connection.
const TINTS = { idle: [0, 0, 0, 0], held: [0, 0.12, 0.06, 0.12], again: [0.16, 0.11, 0, 0.16], closed: [0.2, 0, 0, 0.2] };
const UNUSED = /-(distal|intermediate|tip|twist)$/; // joints, most of them of fingers
// Nose and ears [m] as the middle of the eyes sees them, x to the right, y up, z backward: how a head is turned.
const HEAD = { nose: [0, -0.025, -0.04], left_ear: [-0.072, 0, 0.08], right_ear: [0.072, 0, 0.08] };

export class Headset {
  // section: the element that it fills, hidden where the browser has no headset; live: where points go; begins: called
  // before they come from here.
  constructor(section, live, begins = () => {}) {
    this.section = section;
    this.live = live;
    this.begins = begins;
    this.session = null;
    this.pressed = new Map(); // what is pressed on each controller
    this.button = document.createElement("button");
    this.button.type = "button";
    this.button.id = "headset-start";
    this.notice = document.createElement("p");
    this.notice.setAttribute("role", "alert");
    const heading = document.createElement("h2"), how = document.createElement("p");
    heading.textContent = "Headset";
    how.textContent = "The robot follows your body while you hold a controller's trigger or grip.";
    section.append(heading, how, this.button, this.notice);
    this.button.addEventListener("click", () => (this.session ? this.session.end() : this.start()));
    this.tell("");
    this.look();
  }

  tell(text) {
    this.notice.textContent = text;
    this.button.textContent = this.session ? "Leave" : "Begin in the headset";
  }

  async look() {
    for (const mode of MODES) {
      if (!(await navigator.xr?.isSessionSupported(mode).catch(() => false))) continue;
      this.mode = mode;
      this.section.hidden = false;
      return;
    }
  }

  async start() {
    try {
      const session = await navigator.xr.requestSession(this.mode, { requiredFeatures: ["local-floor", "body-tracking"] });
      this.session = session;
      session.addEventListener("end", () => this.ended());
      session.addEventListener("visibilitychange", () => { if (session.visibilityState !== "visible") this.letGo(); });
      session.addEventListener("inputsourceschange", ({ removed }) => removed.forEach((source) => this.release(null, source)));
      for (const kind of ["select", "squeeze"]) {
        session.addEventListener(`${kind}start`, ({ inputSource }) => this.press(kind, inputSource));
        session.addEventListener(`${kind}end`, ({ inputSource }) => this.release(kind, inputSource));
      }
      this.begins();
      const gl = document.createElement("canvas").getContext("webgl", { xrCompatible: true });
      const layer = new XRWebGLLayer(session, gl);
      await session.updateRenderState({ baseLayer: layer });
      const world = await session.requestReferenceSpace("local-floor");
      const frame = (time, seen) => {
        if (session !== this.session) return;
        session.requestAnimationFrame(frame);
        this.send(time, seen, world);
        gl.bindFramebuffer(gl.FRAMEBUFFER, layer.framebuffer);
        gl.clearColor(...TINTS[this.state()]);
        gl.clear(gl.COLOR_BUFFER_BIT);
      };
      session.requestAnimationFrame(frame);
      this.tell("");
    } catch (error) {
      await this.session?.end().catch(() => {});
      this.tell(error.name === "NotSupportedError" ? "this headset's browser tracks no bodies, or is not allowed to"
        : `the headset does not begin: ${error.message ?? error}`);
    }
  }

  state() {
    if (!this.live.connected) return "closed";
    return this.live.held ? "held" : this.pressed.size ? "again" : "idle";
  }

  press(kind, source) {
    this.pressed.set(source, (this.pressed.get(source) ?? new Set()).add(kind));
    this.live.hold(true);
  }

  // The last one that lets go stops the robot; without a kind, the controller is gone, and all that was pressed on it.
  release(kind, source) {
    this.pressed.get(source)?.delete(kind);
    if (!kind || !this.pressed.get(source)?.size) this.pressed.delete(source);
    if (!this.pressed.size) this.letGo();
  }

  // What is still pressed does not count any more.
  letGo() { this.live.hold(false); }

  ended() {
    this.session = null;
    this.pressed.clear();
    this.letGo();
    this.live.nobody(performance.now() / 1000);
    this.tell("");
  }

  // One frame: its body's points, and the head's by where the headset is.
  send(time, frame, world) {
    if (this.live.held && time - (this.beaten ?? 0) > BEAT_MS) {
      this.beaten = time;
      this.live.beat();
    }
    const names = [], points = [];
    for (const [name, space] of frame.body ?? []) {
      const pose = UNUSED.test(name) ? null : frame.getPose(space, world);
      if (!pose) continue;
      const { x, y, z } = pose.transform.position;
      names.push(name);
      points.push([x, y, z]);
    }
    if (!points.length) return this.live.nobody(time / 1000);
    const head = frame.getViewerPose(world)?.transform.matrix;
    if (head) {
      for (const [name, [x, y, z]] of Object.entries(HEAD)) {
        names.push(name);
        points.push([0, 1, 2].map((row) => head[row] * x + head[4 + row] * y + head[8 + row] * z + head[12 + row]));
      }
    }
    this.live.named("webxr", names, points, time / 1000);
  }
}
