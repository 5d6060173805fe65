// The moving part of a sequence: one frame, shown in the scene, in its image, in the charts.

import { Covisible } from "./covisible.js";
import { Cursors } from "./cursor.js";
import { load } from "./data.js";
import { FrameView } from "./frame.js";
import { Scene } from "./scene.js";
import { onColours } from "./theme.js";

const FRAMES_A_SECOND = 20;
const TRIAD = `<line data-axis="x"/><line data-axis="y"/><line data-axis="z"/>
  <text data-axis="x">x</text><text data-axis="y">y</text><text data-axis="z">z</text>`;

export class Explorer {
  constructor(root) {
    this.root = root;
    const find = (selector) => root.querySelector(selector);
    const sequence = load(root);
    this.sequence = sequence;
    this.frames = sequence.frameIds.length;
    for (const element of root.querySelectorAll(".needs-script")) element.hidden = false;
    this.slider = find(".slider");
    this.where = find(".where");
    this.play = find(".play");
    if (!this.frames) {
      find(".transport").hidden = find(".covisible").hidden = true;
      return;
    }
    this.startScene(find("canvas.scene"), find(".still"), find(".stage-buttons"));
    const canvas = find("canvas.frame");
    canvas.hidden = false;
    const camera = sequence.cameras[sequence.frameCameras[0]] ?? sequence.cameras[0];
    if (camera) canvas.style.aspectRatio = `${camera.width} / ${camera.height}`;
    this.views = [
      new FrameView(canvas, sequence, find(".pointed"), find(".frame-table"), (feature) => this.scene?.point(feature)),
      new Covisible(find(".strip"), find(".sharing"), sequence, (frame) => this.setFrame(frame)),
      new Cursors(root.closest(".sequence"), sequence, (frame) => this.setFrame(frame)),
    ];
    this.slider.addEventListener("input", () => this.setFrame(Number(this.slider.value)));
    const commands = {
      before: () => this.setFrame(this.frame - 1),
      after: () => this.setFrame(this.frame + 1),
      play: () => this.toggle(),
    };
    for (const [name, command] of Object.entries(commands)) {
      find(`.transport [data-do=${name}]`).addEventListener("click", command);
    }
    onColours(() => {
      this.scene?.recolour();
      this.views.forEach((view) => view.draw?.());
    });
    this.setFrame(0);
    root.dataset.ready = "";
  }

  startScene(canvas, still, buttons) {
    const triad = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    triad.setAttribute("class", "triad");
    triad.setAttribute("viewBox", "-40 -40 80 80");
    triad.setAttribute("aria-hidden", "true");
    triad.innerHTML = TRIAD;
    canvas.after(triad);
    canvas.hidden = false;
    try {
      this.scene = new Scene(canvas, triad, this.sequence);
    } catch (problem) {
      // The still picture stays.
      canvas.hidden = true;
      triad.remove();
      this.root.dataset.scene = problem.message;
      return;
    }
    still.hidden = true;
    buttons.hidden = false;
    const { scene } = this;
    const follow = buttons.querySelector("[data-do=camera]");
    scene.onFollows = (follows) => follow.setAttribute("aria-pressed", follows);
    const commands = {
      closer: () => scene.orbit.scale(1.25),
      farther: () => scene.orbit.scale(0.8),
      top: () => scene.orbit.top(),
      all: () => scene.orbit.reset(),
      camera: () => {},
    };
    for (const [name, command] of Object.entries(commands)) {
      buttons.querySelector(`[data-do=${name}]`).addEventListener("click", () => {
        scene.setFollows(name === "camera" && !scene.follows);
        command();
        scene.draw();
      });
    }
    for (const box of this.root.querySelectorAll("[data-show]")) {
      box.addEventListener("change", () => {
        if (box.checked) scene.hidden.delete(box.dataset.show);
        else scene.hidden.add(box.dataset.show);
        scene.draw();
      });
    }
  }

  setFrame(frame) {
    const kept = Math.max(0, Math.min(this.frames - 1, frame));
    this.frame = kept;
    this.root.dataset.frame = kept;
    const { sequence } = this;
    const count = (kind) => sequence[kind].starts[kept + 1] - sequence[kind].starts[kept];
    const id = `frame ${sequence.frameIds[kept]}`;
    this.slider.value = kept;
    this.slider.setAttribute("aria-valuetext", id);
    this.where.textContent = `${id} · ${sequence.seconds[kept].toFixed(2)} s · ${count("points")} points · ${count("lines")} segments`;
    this.scene?.setFrame(kept);
    this.scene?.draw();
    this.views.forEach((view) => view.setFrame(kept));
  }

  toggle() {
    this.plays = !this.plays;
    this.play.setAttribute("aria-pressed", this.plays);
    this.play.setAttribute("aria-label", this.plays ? "Pause" : "Play");
    this.play.textContent = this.plays ? "❚❚ Pause" : "▶ Play";
    if (!this.plays) return;
    let begun = performance.now();
    const step = (now) => {
      if (!this.plays || this.root.closest("[hidden]")) return;
      const steps = Math.floor(((now - begun) * FRAMES_A_SECOND) / 1000);
      if (steps > 0) {
        begun += (steps * 1000) / FRAMES_A_SECOND;
        this.setFrame((this.frame + steps) % this.frames);
      }
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}
