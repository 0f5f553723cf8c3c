// The robot as it is told to move, drawn from the front: `robot.json` has its bodies (mrhubo/live/figure.py says how).

import { withToken } from "./live.js";

const TURN = 0.35, TILT = 0.18; // from where it is seen [rad]: from its left, and from above
const LAMP = [0.6, -0.35, 0.72];

const HOME = { position: [0, 0, 0], quaternion_wxyz: [1, 0, 0, 0] };
const TILE = 0.25; // of the floor, how wide [m]

// Poses of the bodies, rows of 4 by 4, at joint angles [rad] and a base's pose, as messages tell it.
export function places(bodies, angles, base = HOME) {
  const found = [];
  for (const body of bodies) {
    const value = body.multiplier * (angles[body.column] ?? 0) + body.offset;
    const local = times(body.origin, body.slides ? slide(body.axis, value) : turn(body.axis, value));
    found.push(times(body.parent === null ? poseOf(base) : found[body.parent], local));
  }
  return found;
}

// Of a unit quaternion, w first.
export function poseOf({ position: [px, py, pz], quaternion_wxyz: [w, x, y, z] }) {
  return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), px],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), py],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), pz], [0, 0, 0, 1]];
}

function times(a, b) {
  return a.map((row) => b[0].map((_, j) => row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j] + row[3] * b[3][j]));
}

function slide([x, y, z], way) {
  return [[1, 0, 0, way * x], [0, 1, 0, way * y], [0, 0, 1, way * z], [0, 0, 0, 1]];
}

// Rodrigues' formula, of a unit axis.
function turn([x, y, z], angle) {
  const c = Math.cos(angle), s = Math.sin(angle), d = 1 - c;
  return [[c + x * x * d, x * y * d - z * s, x * z * d + y * s, 0], [y * x * d + z * s, c + y * y * d, y * z * d - x * s, 0],
    [z * x * d - y * s, z * y * d + x * s, c + z * z * d, 0], [0, 0, 0, 1]];
}

const moved = (pose, p) => [0, 1, 2].map((i) => pose[i][0] * p[0] + pose[i][1] * p[1] + pose[i][2] * p[2] + pose[i][3]);

// To the right, up, and towards who looks [m]; the robot looks along x, its left is y, and up is z.
function seen([x, y, z]) {
  const ahead = x * Math.cos(TURN) + y * Math.sin(TURN), right = y * Math.cos(TURN) - x * Math.sin(TURN);
  return [right, z * Math.cos(TILT) - ahead * Math.sin(TILT), ahead * Math.cos(TILT) + z * Math.sin(TILT)];
}

export class RobotView {
  // Asks for the robot; where nobody knows how it looks, `section` stays hidden.
  constructor(section, canvas) {
    this.canvas = canvas;
    this.bodies = null;
    this.angles = null;
    this.base = undefined; // undefined: it is fixed
    this.at = [0, 0]; // where on the floor it is looked at
    this.drawn = true;
    fetch(withToken("robot.json")).then((answer) => (answer.ok ? answer.json() : null), () => null).then((figure) => {
      if (!figure) return;
      this.bodies = figure.bodies;
      section.hidden = false;
      this.fit();
      this.show(this.angles ?? [], this.base);
    });
  }

  // Looks how far the robot reaches, its arms wherever they may be.
  fit() {
    const ends = this.capsules([]).flatMap(({ from, to, wide }) => [[from, wide], [to, wide]]);
    const low = Math.min(...ends.map(([p, r]) => p[1] - r)), high = Math.max(...ends.map(([p, r]) => p[1] + r));
    this.middle = [0, (low + high) / 2];
    this.reach = Math.max((this.base ? 0.8 : 0.65) * (high - low), ...ends.map(([p, r]) => Math.abs(p[0]) + r));
  }

  // Joint angles [rad] of a message, and where the base is; drawn with the next picture of the screen, the newest alone.
  show(angles, base) {
    this.angles = angles;
    if (base && !this.base) this.stand(base);
    this.base = base;
    if (!this.drawn || !this.bodies) return;
    this.drawn = false;
    requestAnimationFrame(() => { this.drawn = true; this.draw(); });
  }

  // A robot that moves about is shown with room around it, and followed from a distance.
  stand({ position }) {
    this.at = position.slice(0, 2);
    this.base = { position, quaternion_wxyz: HOME.quaternion_wxyz };
    if (this.bodies) this.fit();
  }

  // Where the view is, so that the robot stays in its middle half.
  follow() {
    const room = this.reach / 2;
    this.at = this.at.map((place, i) => Math.min(Math.max(place, this.base.position[i] - room), this.base.position[i] + room));
  }

  // Relative to where the robot is looked at.
  local() {
    const { position: [x, y, z], quaternion_wxyz } = this.base;
    return { position: [x - this.at[0], y - this.at[1], z], quaternion_wxyz };
  }

  // Lines on the floor that stay in the world.
  floor(pen, at) {
    const near = (place) => Math.ceil((place - this.reach) / TILE) * TILE - place, far = this.reach;
    pen.strokeStyle = "rgba(128, 128, 128, 0.45)";
    pen.lineWidth = 1;
    for (let i = 0; i < 2; i += 1) {
      for (let place = near(this.at[i]); place <= far; place += TILE) {
        pen.beginPath();
        pen.moveTo(...at(seen(i ? [-far, place, 0] : [place, -far, 0])));
        pen.lineTo(...at(seen(i ? [far, place, 0] : [place, far, 0])));
        pen.stroke();
      }
    }
  }

  capsules(angles) {
    const poses = places(this.bodies, angles, this.base ? this.local() : HOME);
    return this.bodies.flatMap((body, place) => body.capsules.map((row) => {
      const from = moved(poses[place], row.slice(0, 3)), to = moved(poses[place], row.slice(3, 6));
      return { from: seen(from), to: seen(to), wide: Math.max(row[6], row[7]), color: row.slice(8) };
    }));
  }

  draw() {
    const { canvas } = this, side = Math.min(canvas.width, canvas.height) / (2.1 * this.reach);
    const pen = canvas.getContext("2d");
    pen.clearRect(0, 0, canvas.width, canvas.height);
    pen.lineCap = "round";
    const at = ([x, y]) => [canvas.width / 2 + side * (x - this.middle[0]), canvas.height / 2 - side * (y - this.middle[1])];
    if (this.base) {
      this.follow();
      this.floor(pen, at);
    }
    const depth = ({ from, to, wide }) => Math.max(from[2], to[2]) + wide;
    for (const { from, to, wide, color } of this.capsules(this.angles).sort((a, b) => depth(a) - depth(b))) {
      const a = at(from), b = at(to), length = Math.hypot(b[0] - a[0], b[1] - a[1]);
      if (length < 0.5) b[0] = a[0] + 0.5; // a point of a line is drawn as a dot
      // An outline, the body, and where the lamp is mirrored: three strokes make a rod round.
      for (const [share, light, aside] of [[1, 0.45, 0], [0.88, 0.86, 0], [0.4, 1.08, 0.2]]) {
        const shift = [side * wide * aside * LAMP[1], -side * wide * aside * LAMP[2]];
        pen.lineWidth = Math.max(1, 2 * side * wide * share);
        pen.strokeStyle = `rgb(${color.map((part) => Math.min(255, Math.round(part * light))).join()})`;
        pen.beginPath();
        pen.moveTo(a[0] + shift[0], a[1] + shift[1]);
        pen.lineTo(b[0] + shift[0], b[1] + shift[1]);
        pen.stroke();
      }
    }
  }
}
