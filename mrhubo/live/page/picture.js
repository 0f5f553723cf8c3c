// The camera's picture with the points that were found in it.

const LINES = [[11, 12], [11, 13], [13, 15], [12, 14], [14, 16], [11, 23], [12, 24], [23, 24], [23, 25], [25, 27],
  [24, 26], [26, 28], [27, 31], [28, 32], [15, 19], [16, 20], [15, 21], [16, 22], [15, 17], [16, 18]];
const SURE = 0.5;
const COLORS = {left: "#f2a65a", right: "#5ab4f2", both: "#e6e9ee"};

// Places of a person's left are odd, from the shoulders on.
const sideOf = (a, b) => a % 2 !== b % 2 ? "both" : a % 2 ? "left" : "right";

export function draw(canvas, image, points) {
  const width = image.videoWidth ?? image.width, height = image.videoHeight ?? image.height;
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
  const pen = canvas.getContext("2d");
  pen.drawImage(image, 0, 0, canvas.width, canvas.height);
  if (!points) return;
  const at = points.map(point => [point.x * canvas.width, point.y * canvas.height]);
  const sure = place => (points[place].visibility ?? 0) >= SURE;
  pen.lineWidth = Math.max(2, canvas.width / 160);
  pen.lineCap = "round";
  for (const [a, b] of LINES) {
    pen.globalAlpha = sure(a) && sure(b) ? 1 : 0.25;
    pen.strokeStyle = COLORS[sideOf(a, b)];
    pen.beginPath();
    pen.moveTo(...at[a]);
    pen.lineTo(...at[b]);
    pen.stroke();
  }
  pen.fillStyle = "#fff";
  points.forEach((_, place) => {
    pen.globalAlpha = sure(place) ? 1 : 0.25;
    pen.beginPath();
    pen.arc(...at[place], pen.lineWidth * 0.8, 0, 2 * Math.PI);
    pen.fill();
  });
  pen.globalAlpha = 1;
}
