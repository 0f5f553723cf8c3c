// The panels beside a recorded stage. viser's page has the timeline, play and speed; where it is stands in its slider.
(() => {
  const NARROW = 760; // pixels of a page, as of a frame in another, in which the panel would hide the figures
  const robots = JSON.parse(document.getElementById("mrhubo-robots").textContent);
  const panel = document.getElementById("mrhubo-panel");
  const chosen = panel.querySelector("select.robot");
  const sections = [...panel.querySelectorAll("section")];
  const show = () => sections.forEach((section, number) => { section.hidden = number !== Number(chosen.value); });
  chosen.addEventListener("change", show);
  show();
  for (const section of sections) {
    const joint = section.querySelector("select.joint");
    const curves = [...section.querySelectorAll(".curve")];
    const pick = () => curves.forEach((curve, number) => { curve.hidden = number !== Number(joint.value); });
    joint.addEventListener("change", pick);
    pick();
  }
  panel.querySelector("button").addEventListener("click", () => panel.classList.toggle("closed"));
  panel.classList.toggle("closed", innerWidth < NARROW);
  let shown = null;
  const draw = () => {
    const slider = document.querySelector('[role="slider"]');
    const time = slider === null ? NaN : Number(slider.getAttribute("aria-valuenow"));
    if (Number.isFinite(time) && time !== shown) {
      shown = time;
      sections.forEach((section, number) => {
        const { rate, frames, left, right, shares, scale, near, colors } = robots[number];
        const frame = Math.min(Math.max(Math.round(time * rate), 0), frames - 1);
        for (const line of section.querySelectorAll(".now")) {
          const x = (line.ownerSVGElement.viewBox.baseVal.width * frame) / Math.max(frames - 1, 1);
          line.setAttribute("x1", x);
          line.setAttribute("x2", x);
        }
        section.querySelectorAll(".mark").forEach((mark, row) => {
          const share = shares[frame][row];
          mark.setAttribute("cx", left + ((right - left) * share) / scale);
          mark.setAttribute("fill", colors[Number(Math.min(share, scale - share) < near)]);
        });
        section.querySelector(".time").textContent = `${time.toFixed(2)} s, frame ${frame + 1} of ${frames}`;
      });
    }
    requestAnimationFrame(draw);
  };
  draw();
})();
