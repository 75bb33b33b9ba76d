import { expect, it, vi } from "vitest";
import type { Vec3 } from "../core/basics/geometry.ts";
import type { Pose } from "../core/movement/address.ts";
import type { Astray } from "../core/movement/astray.ts";
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
  lookBeside: vi.fn(),
  eye: (position: Vec3) => ({ position, viewAngle_rad: 1, height_px: 720 }),
  cast: () => false,
  recast: () => {},
  render: () => {},
  close: () => {},
} as unknown as Stage;
/** The page that a visit is on. */
const page = Object.assign(new EventTarget(), { hidden: false });
const display: Display = { title: () => {}, mode: () => {}, show: () => {} };
const controls = {
  close: () => {},
  letGo: () => {},
  turnByKeys: () => {},
  intent: () => ({ forward: 0, right: 0, up: 0, fast: false }),
} as unknown as Controls;

const walking = {
  ...controls,
  intent: () => ({ forward: 1, right: 0, up: 0, fast: false }),
} as unknown as Controls;

/** A visit whose frames are drawn when a test says so, and the poses that its page's address was given. */
async function visitAt(pose: Pose, wish = controls) {
  let next: FrameRequestCallback | undefined;
  vi.stubGlobal("matchMedia", () => ({ matches: false }));
  vi.stubGlobal("document", page);
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
  visit.begin(wish);
  /** Answers whether there was one. */
  const frame = (now_ms: number) => {
    const asked = next;
    next = undefined;
    asked?.(now_ms);
    return asked !== undefined;
  };
  return { visit, written, strayed, frame };
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

it("who looks at a frozen view looks beside what covers the picture, until it is over", async () => {
  const { visit } = await visitAt(STOOD);
  const covered = () => ({ right_px: 372, bottom_px: 0 });
  visit.freeze(covered);
  expect(stage.lookBeside).toHaveBeenLastCalledWith(covered);
  visit.thaw();
  expect(stage.lookBeside).toHaveBeenLastCalledWith();
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

it("a link whose place cannot be read says so and leads nowhere, and one that names none says nothing", async () => {
  const { visit, strayed } = await visitAt(STOOD);
  expect([visit.followLink("#p=1,NaN,2"), strayed]).toEqual([false, ["unreadable"]]);
  expect([visit.followLink("#rev=abc"), strayed.length]).toEqual([false, 1]);
  expect(visit.walker.position).toEqual(STOOD.position);
  expect([visit.followLink("#p=2,1.6,3"), strayed.length]).toEqual([true, 1]);
  expect(visit.walker.position).toEqual([2, 1.6, 3]);
  visit.close();
});

it("who turns to another page while walking stands there, since no frame says anything of it", async () => {
  const letGo = vi.fn();
  const listen = vi.spyOn(page, "addEventListener");
  const { visit, frame } = await visitAt(STOOD, { ...walking, letGo } as unknown as Controls);
  expect(listen.mock.calls.map(([kind]) => kind)).toEqual(["visibilitychange"]);
  const rested = vi.fn(() => Math.hypot(...visit.walker.speed));
  visit.onRest(rested);
  let now_ms = 0;
  const walk = () => {
    for (let i = 0; i < 2; i += 1) {
      now_ms += 50;
      frame(now_ms);
    }
    return Math.hypot(...visit.walker.speed);
  };
  expect(walk()).toBeGreaterThan(0.5);
  const turn = (hidden: boolean) => {
    page.hidden = hidden;
    page.dispatchEvent(new Event("visibilitychange"));
  };
  turn(true);
  expect(visit.walker.speed).toEqual([0, 0, 0]);
  turn(false);
  expect(letGo, "what is held does not move one on").toHaveBeenCalledOnce();
  expect(
    rested.mock.results.map(({ value }) => value),
    "who is told so stands already",
  ).toEqual([0]);
  expect(walk()).toBeGreaterThan(0.5);
  visit.close();
  turn(true);
  expect(Math.hypot(...visit.walker.speed), "nobody is there any more").toBeGreaterThan(0.5);
  page.hidden = false;
});

it("asks for no frames that nobody sees once nothing happens, until it goes elsewhere, and hears nothing more when it is closed", async () => {
  const close = vi.fn();
  const { visit, frame } = await visitAt(STOOD, { ...controls, close } as unknown as Controls);
  let now_ms = 0;
  const rest = async () => {
    for (let frames = 0; ; frames += 1) {
      now_ms += 100;
      if (!frame(now_ms)) return frames;
      await new Promise((resolve) => setTimeout(resolve, 2));
    }
  };
  visit.watch(false);
  // What arrives has frames again.
  while (visit.explorer.visibleCount === undefined) {
    await rest();
    await new Promise((resolve) => setTimeout(resolve, 2));
  }
  await rest();
  visit.teleport({ ...STOOD, yaw: 1 });
  expect(await rest()).toBeGreaterThan(0);
  visit.watch(true);
  expect(frame(now_ms + 100)).toBe(true);
  visit.close();
  expect(close).toHaveBeenCalledOnce();
  frame(now_ms + 200);
  expect(frame(now_ms + 300)).toBe(false);
});
