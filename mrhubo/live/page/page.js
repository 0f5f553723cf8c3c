// What the page shows of a session. Text from messages is set as text, never as markup.

import { Camera } from "./camera.js";
import { Headset } from "./headset.js";
import { Live, deadman } from "./live.js";
import { RobotView } from "./robot.js";

const at = (id) => document.getElementById(id);
const make = (tag, text = "") => Object.assign(document.createElement(tag), { textContent: text });
const WHY = {
  stopped: "The robot stands. Hold the button and it follows.",
  waiting: "Nobody has been seen yet.",
  following: "",
  doubtful: "Some parts of the person are hardly seen.",
  ended: "The session has ended.",
};

let rows = [];
let release = () => {};

function tell(state, why) {
  at("state").textContent = state;
  at("state").className = `state ${state}`;
  at("why").textContent = why;
}

function show(message) {
  tell(message.state, WHY[message.state] ?? "");
  robot.show(message.angles, message.base);
  if (rows.length !== message.names.length) {
    rows = message.names.map((name) => { const row = make("tr"); row.append(make("td", name), make("td"), make("td")); return row; });
    at("joints").replaceChildren(...rows);
  }
  rows.forEach((row, i) => {
    row.children[1].textContent = message.angles[i].toFixed(3);
    row.children[2].textContent = message.velocities[i].toFixed(2);
  });
  at("confidence").replaceChildren(...Object.entries(message.confidence).map(([name, value]) => {
    const line = make("div"), meter = make("meter");
    meter.value = value;
    meter.setAttribute("aria-label", name);
    line.append(make("span", name.replaceAll("_", " ")), meter, make("span", value.toFixed(2)));
    return line;
  }));
  if (message.counts) {
    const told = Object.entries(message.counts).filter(([, count]) => count > 0);
    at("counts").replaceChildren(...told.flatMap(([kind, count]) => [make("dt", kind.replaceAll("_", " ")), make("dd", count)]));
  }
}

const robot = new RobotView(at("robot"), at("figure"));
const live = new Live({
  joints: show,
  open: () => tell("connected", "Nothing has come yet."),
  closed: (reason) => { release(); tell("closed", `Not connected: ${reason}.`); },
});
release = deadman(live, at("hold"));
const camera = new Camera(at("stage"), live, () => release(), (mirrored) => at("figure").classList.toggle("mirrored", mirrored));
new Headset(at("headset"), live, () => camera.stop());
