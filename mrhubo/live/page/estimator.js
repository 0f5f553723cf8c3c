// The points of a body in pictures, by npm's @mediapipe/pose, which the server hands on from where `mrhubo models` put it.

const FOLDER = "pose/";

export class Estimator {
  // Loads it; refuses with what is missing.
  static async make(complexity) {
    if (!globalThis.Pose) {
      const there = await fetch(FOLDER + "pose.js").then(answer => answer.ok, () => false);
      if (!there) throw new Error("the models are not there: run `mrhubo models`, and reload this page");
      await new Promise((done, fail) => {
        const script = document.createElement("script");
        script.src = FOLDER + "pose.js";
        script.onload = done;
        script.onerror = () => fail(new Error("pose.js cannot be loaded"));
        document.head.append(script);
      });
    }
    const estimator = new Estimator();
    estimator.pose = new globalThis.Pose({locateFile: name => FOLDER + name});
    estimator.pose.setOptions({selfieMode: false, smoothLandmarks: true, modelComplexity: complexity});
    estimator.pose.onResults(results => { estimator.found = results; });
    await estimator.pose.initialize();
    return estimator;
  }

  choose(complexity) { this.pose.setOptions({modelComplexity: complexity}); }

  // What is found: `world`, 33 points [m], `picture`, the same from 0 to 1 (both missing where nobody is), and `image`,
  // the picture in which they are.
  async look(image) {
    this.found = null;
    await this.pose.send({image});
    const {poseWorldLandmarks: world, poseLandmarks: picture, image: seen} = this.found ?? {};
    return {image: seen, ...(world && picture ? {world, picture} : {})};
  }
}
