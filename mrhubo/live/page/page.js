// The page of a live session: a camera's pictures become points, points go to the server, and its answers are shown.

import {Estimator} from "./estimator.js";
import {Link} from "./link.js";
import {bars, draw} from "./picture.js";

const at = id => document.getElementById(id);
const video = at("video"), canvas = at("picture"), hold = at("hold");
let estimator = null, stream = null, running = 0, counted = 0, since = performance.now();

const say = text => { at("notice").textContent = text; };

function show(state) {
  at("state").textContent = state;
  at("state").className = state;
}

const link = new Link(message => {
  if (message.kind !== "joints") return;
  show(message.state);
  const degrees = message.angles.map(angle => angle * 180 / Math.PI);
  bars(at("joints"), message.names, degrees, -180, 180, value => `${value.toFixed(1)}°`);
  bars(at("confidence"), Object.keys(message.confidence), Object.values(message.confidence), 0, 1, v => v.toFixed(2));
}, connected => { show(connected ? "stopped" : "not connected"); release(); });

// The dead-man's button: held by finger, mouse or space bar; let go when any of them, the window or the camera goes.

function press() {
  if (hold.disabled) return;
  link.hold(true);
  hold.classList.add("held");
}

function release() {
  link?.hold(false);
  hold.classList.remove("held");
}

hold.addEventListener("pointerdown", event => { event.preventDefault(); hold.setPointerCapture(event.pointerId); press(); });
for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) hold.addEventListener(kind, release);
hold.addEventListener("contextmenu", event => event.preventDefault());
addEventListener("keydown", event => {
  if (event.code !== "Space") return;
  event.preventDefault();
  if (!event.repeat) press();
});
addEventListener("keyup", event => { if (event.code === "Space") { event.preventDefault(); release(); } });
addEventListener("blur", release);
addEventListener("pagehide", release);
document.addEventListener("visibilitychange", () => { if (document.hidden) release(); });

// The camera

async function start() {
  stop();
  if (!navigator.mediaDevices) return say("a browser gives a camera to pages of this machine, or by https, alone");
  try {
    say("loading the models ...");
    estimator ??= await Estimator.make(Number(at("model").value));
    say("asking for the camera ...");
    const id = at("camera").value;
    const wanted = {width: {ideal: 640}, height: {ideal: 480}, ...(id ? {deviceId: {exact: id}} : {facingMode: "user"})};
    stream = await navigator.mediaDevices.getUserMedia({video: wanted, audio: false});
    stream.getVideoTracks()[0].addEventListener("ended", () => { stop(); say("the camera is gone"); });
    video.srcObject = stream;
    await video.play();
    await list();
    say("");
    hold.disabled = false;
    watch(running);
  } catch (error) {
    stop();
    say(error.name === "NotAllowedError" ? "the browser does not allow the camera" : `${error.message ?? error}`);
  }
}

function stop() {
  running += 1;
  release();
  hold.disabled = true;
  stream?.getTracks().forEach(track => track.stop());
  stream = null;
}

async function list() {
  const cameras = (await navigator.mediaDevices.enumerateDevices()).filter(device => device.kind === "videoinput");
  const now = stream.getVideoTracks()[0].getSettings().deviceId;
  at("camera").replaceChildren(...cameras.map((camera, place) => {
    const option = new Option(camera.label || `camera ${place + 1}`, camera.deviceId);
    option.selected = camera.deviceId === now;
    return option;
  }));
}

// One picture after the other, each the newest that there is; slow models leave pictures out, and nothing waits.
async function watch(run) {
  let last = 0;
  while (run === running) {
    const taken = await new Promise(done => video.requestVideoFrameCallback(now => done(now)));
    if (run !== running) return;
    try {
      const begun = performance.now();
      const found = await estimator.look(video);
      if (run !== running) return;
      link.see(found.world, Math.max(taken, last + 0.001));
      last = Math.max(taken, last + 0.001);
      draw(canvas, found.image ?? video, found.picture);
      count(performance.now() - begun, found.world !== undefined);
    } catch (error) {
      stop();
      return say(`the models failed: ${error.message ?? error}`);
    }
  }
}

function count(took, seen) {
  counted += 1;
  const passed = performance.now() - since;
  if (passed < 500) return;
  at("figures").textContent = `${(1000 * counted / passed).toFixed(0)} pictures a second, ${took.toFixed(0)} ms each`
    + (seen ? "" : "; nobody is seen");
  counted = 0;
  since = performance.now();
}

at("start").addEventListener("click", start);
at("camera").addEventListener("change", start);
at("model").addEventListener("change", () => estimator?.choose(Number(at("model").value)));
at("mirror").addEventListener("change", () => canvas.classList.toggle("mirrored", at("mirror").checked));
canvas.classList.toggle("mirrored", at("mirror").checked);
