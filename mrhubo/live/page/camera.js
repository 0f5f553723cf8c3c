// The camera's part of a live page: pictures become points, points go to the session, and both are shown.

import { Estimator } from "./estimator.js";
import { draw } from "./picture.js";

const MODELS = ["lite", "full", "heavy"];
const make = (tag, more = {}) => Object.assign(document.createElement(tag), more);

export class Camera {
  // stage: the element that it fills; live: where points go, `live.landmarks(points, time)`; release: lets go of the
  // button, as nobody steers a robot by a camera that is gone; mirrored: told whether a picture is shown as by a mirror.
  constructor(stage, live, release, mirrored = () => {}) {
    this.mirrored = mirrored;
    this.live = live;
    this.release = release;
    this.run = 0; // another one with every start and stop
    this.counted = 0;
    this.since = performance.now();
    this.video = make("video", { muted: true, playsInline: true });
    this.canvas = make("canvas", { id: "picture" });
    this.notice = make("p", { id: "notice" });
    this.notice.setAttribute("role", "alert");
    this.figures = make("p", { id: "figures" });
    this.button = make("button", { id: "camera", type: "button", textContent: "Start the camera" });
    this.model = make("select", { id: "model" });
    this.model.append(...MODELS.map((name, place) => new Option(name, place, name === "full", name === "full")));
    this.device = make("select", { id: "device" });
    this.device.append(new Option("default", ""));
    this.mirror = make("input", { id: "mirror", type: "checkbox", checked: true });
    const controls = make("div", { id: "controls" });
    controls.append(this.button, labelled("model", this.model), labelled("camera", this.device), labelled("mirrored", this.mirror));
    stage.append(make("h2", { textContent: "Camera" }), this.canvas, this.notice, controls, this.figures);
    this.button.addEventListener("click", () => (this.stream ? this.stop() : this.start()));
    this.device.addEventListener("change", () => this.start());
    this.model.addEventListener("change", () => this.estimator?.choose(Number(this.model.value)));
    this.mirror.addEventListener("change", () => this.turn());
    this.turn();
  }

  turn() {
    this.canvas.classList.toggle("off", !this.stream); // without a camera nobody is seen any more
    this.canvas.classList.toggle("mirrored", this.mirror.checked);
    this.mirrored(this.mirror.checked && Boolean(this.stream));
  }

  say(text) { this.notice.textContent = text; }

  async start() {
    this.stop();
    const run = this.run;
    try {
      if (!navigator.mediaDevices) throw new Error("browsers give cameras to pages of their own machine, or by https, alone");
      this.say("loading the models ...");
      this.estimator ??= await Estimator.make(Number(this.model.value));
      this.say("asking for the camera ...");
      const id = this.device.value;
      const size = { width: { ideal: 640 }, height: { ideal: 480 } };
      const which = id ? { deviceId: { exact: id } } : { facingMode: "user" };
      const stream = await navigator.mediaDevices.getUserMedia({ video: { ...size, ...which }, audio: false });
      if (run !== this.run) return stream.getTracks().forEach((track) => track.stop());
      this.stream = stream;
      this.turn();
      stream.getVideoTracks()[0].addEventListener("ended", () => { this.stop(); this.say("the camera is gone"); });
      this.video.srcObject = stream;
      await this.video.play();
      await this.list();
      this.say("");
      this.button.textContent = "Stop the camera";
      this.watch(run);
    } catch (error) {
      if (run !== this.run) return;
      this.stop();
      this.say(error.name === "NotAllowedError" ? "the browser does not allow the camera" : `${error.message ?? error}`);
    }
  }

  stop() {
    this.run += 1;
    this.release();
    this.stream?.getTracks().forEach((track) => track.stop());
    if (this.stream) this.live.landmarks(null, performance.now() / 1000);
    this.stream = null;
    this.canvas.getContext("2d").clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.turn();
    this.button.textContent = "Start the camera";
    this.figures.textContent = "";
    this.say("");
  }

  async list() {
    const cameras = (await navigator.mediaDevices.enumerateDevices()).filter(({ kind }) => kind === "videoinput");
    const now = this.stream.getVideoTracks()[0].getSettings().deviceId;
    this.device.replaceChildren(...cameras.map(({ label, deviceId }, place) =>
      new Option(label || `camera ${place + 1}`, deviceId, deviceId === now, deviceId === now)));
  }

  // One picture after the other, each the newest that there is: slow models leave pictures out, and none waits.
  async watch(run) {
    while (run === this.run) {
      const taken = await new Promise((done) => this.video.requestVideoFrameCallback(done));
      if (run !== this.run) return;
      try {
        const begun = performance.now();
        const found = await this.estimator.look(this.video);
        if (run !== this.run) return;
        this.live.landmarks(found.world, taken / 1000);
        draw(this.canvas, found.image ?? this.video, found.picture);
        this.count(performance.now() - begun, found.world !== undefined);
      } catch (error) {
        this.stop();
        return this.say(`the models failed: ${error.message ?? error}`);
      }
    }
  }

  count(took, seen) {
    this.counted += 1;
    const now = performance.now(), passed = (now - this.since) / 1000;
    if (passed < 0.5) return;
    this.figures.textContent = `${(this.counted / passed).toFixed(1)} pictures a second, ${took.toFixed(0)} ms each`
      + (seen ? "" : "; nobody is seen");
    this.counted = 0;
    this.since = now;
  }
}

function labelled(text, input) {
  const label = make("label");
  label.append(`${text} `, input);
  return label;
}
