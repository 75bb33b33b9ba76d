import { expect, it, vi } from "vitest";
import type { Pose } from "../core/address.ts";
import type { Astray } from "../core/astray.ts";
import type { Vec3 } from "../core/geometry.ts";
import { explore } from "../test/explore.ts";
import type { Stage } from "../three/stage.ts";
import type { Controls } from "./controls.ts";
import type { Display } from "./readings.ts";

/** Draws nothing. */
const stage = {
  add: () => {},
  fit: () => {},
  onLost: () => {},
  onRestored: () => {},
  nearAt_m: 1,
  reach: () => {},
  size: { width: 1280, height: 720 },
  resize: () => false,
  aim: () => {},
  corners: () => [],
  cutAbove: () => {},
  eye: (position: Vec3) => ({ position, viewAngle_rad: 1, height_px: 720 }),
  render: () => {},
  close: () => {},
} as unknown as Stage;
const display: Display = { title: () => {}, mode: () => {}, show: () => {} };
const controls = {
  close: () => {},
  turnByKeys: () => {},
  intent: () => ({ forward: 0, right: 0, up: 0, fast: false }),
} as unknown as Controls;

/** A visit whose frames are drawn when a test says so, and the poses that its page's address was given. */
async function visitAt(pose: Pose) {
  let next: FrameRequestCallback = () => {};
  vi.stubGlobal("matchMedia", () => ({ matches: false }));
  vi.stubGlobal("requestAnimationFrame", (callback: FrameRequestCallback) => {
    next = callback;
  });
  const { Visit } = await import("./visit.ts");
  const { scene } = await explore();
  const written: Pose[] = [];
  const posed = ({ position, yaw, pitch }: Pose) => written.push({ position, yaw, pitch });
  const strayed: Astray[] = [];
  const astray = (how: Astray) => strayed.push(how);
  const visit = new Visit({ scene, stage, display, posed, astray, problem: () => {} });
  visit.teleport(pose);
  visit.begin(controls);
  return { visit, written, strayed, frame: (now_ms: number) => next(now_ms) };
}

const STOOD: Pose = { position: [3, 1.6, 3], yaw: 0.5, pitch: 0.1 };

it("links carry the place that one stands at, also where the view is frozen before the address is written", async () => {
  const { visit, written, frame } = await visitAt(STOOD);
  frame(10);
  visit.freeze();
  frame(1000);
  visit.turn(1, 0);
  frame(2000);
  frame(3000);
  expect(written).toEqual([STOOD]);
  visit.thaw();
  frame(4000);
  frame(5000);
  expect(written).toEqual([STOOD, STOOD]);
  visit.close();
});

it("links carry the place that one comes to and freezes between two frames", async () => {
  const { visit, written, frame } = await visitAt(STOOD);
  visit.freeze();
  frame(1000);
  frame(2000);
  expect(written).toEqual([STOOD]);
  visit.close();
});

it("a link says whether one flies there, and is judged once it is known what is there", async () => {
  const { visit, frame, strayed } = await visitAt(STOOD);
  visit.follow({ position: [3, 40, 3], yaw: 0, pitch: 0, mode: "fly" });
  expect(visit.walker.mode).toBe("fly");
  visit.follow({ position: [-20, 1.6, 3], yaw: 0, pitch: 0, mode: "walk" });
  expect(visit.walker.mode).toBe("walk");
  for (let now_ms = 10; strayed.length === 0; now_ms += 10) {
    frame(now_ms);
    await new Promise((resolve) => setTimeout(resolve, 2));
  }
  expect(strayed).toEqual(["outside"]);
  visit.start();
  expect([visit.walker.mode, visit.walker.position]).toEqual(["walk", [1.5, 1.6, 3]]);
  visit.close();
});
