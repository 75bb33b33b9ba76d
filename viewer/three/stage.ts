/**
 * What does the picture look like? Renderer, camera, light and sky: soft light from all around, which metals mirror, a
 * quiet sky and level ground where there is no geometry, and haze before what is far away. Draws only when asked.
 */
import {
  ACESFilmicToneMapping,
  type Object3D,
  PerspectiveCamera,
  Plane,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { type Bounds, diagonal_m, type Vec3 } from "../core/basics/geometry.ts";
import { Resolution } from "../core/pace/resolution.ts";
import type { Eye } from "../core/strategy/sight.ts";
import { FILL, lamp, SKYLIGHT, SUN } from "./daylight.ts";
import { nextTask, Programs, rarerMeshes, usualMeshes } from "./programs.ts";
import { shade } from "./shading.ts";
import type { Casting } from "./shadowmap.ts";
import { Shadows } from "./shadows.ts";
import { ShadowUse, type Wish } from "./shadowuse.ts";
import { Sky } from "./sky.ts";
import { skylight } from "./skylight.ts";
import { ViewVolume } from "./viewvolume.ts";

const VIEW_ANGLE_DEG = 62;
/** What is nearer than this is not drawn; in a world no larger than a few metres, than this share of it. */
const NEAR_M = 0.06;
const NEAR_SHARE = 0.01;
/** Nor what is nearer than this share of the way to the nearest thing that can be seen: other people may be on the way. */
const NEAR_OF_CLEARANCE = 0.03;
const MAX_PIXEL_RATIO = 2;
/** Pixels are given up until the picture is so small, a share of its full width and height. */
const LEAST_SCALE = 0.35;

shade();

/** This browser or machine cannot draw with WebGL. Says what to do, since whoever embeds a world is handed it as it is. */
export class NoWebGlError extends Error {
  override readonly name = "NoWebGlError";

  constructor() {
    super(
      "This browser cannot draw with WebGL 2. Switch on hardware acceleration in its settings, or open this page in another browser.",
    );
  }
}

export type { Matrix4, Object3D } from "three";

/** Pictures of one's own, which others show: drawn once, and again by a graphics card that has lost them. */
export interface Painting {
  /** What is drawn for them, to be prepared. */
  sample(): Object3D;
  draw(renderer: WebGLRenderer): void;
}

/** So much of the picture nobody sees, at its right and its bottom, in CSS pixels. */
export interface Covered {
  readonly right_px: number;
  readonly bottom_px: number;
}

export class Stage {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(VIEW_ANGLE_DEG, 1, NEAR_M, 2000);
  private readonly renderer: WebGLRenderer;
  private readonly sky = new Sky();
  private readonly sun = lamp(SUN);
  /** Where they are drawn. */
  private readonly shadows: Shadows | undefined;
  private readonly programs: Programs;
  private readonly resolution = new Resolution(LEAST_SCALE);
  private movingScale = 1;
  /** In the last picture. */
  private drawn = { calls: 0, triangles: 0 };
  private isRenewing = false;
  /** How often the graphics card was lost. */
  private losses = 0;
  private readonly paintings: Painting[] = [];
  private top_m: number | undefined;
  /** The near plane is no nearer, and the far plane no nearer either. */
  private least_m = { near: NEAR_M, far: 2000 };
  private covered: (() => Covered) | undefined;
  /** Of the world, from corner to corner, and to the nearest thing that can be seen. */
  private readonly extent_m = { across: 0, clearance: 0 };

  /** Answers when it can draw. Whether shadows of the sun are drawn one may say; else it depends on the machine. */
  static async open(canvas: HTMLCanvasElement, shadows?: Wish): Promise<Stage> {
    const fast = hasFastGraphics();
    const coarse = globalThis.matchMedia?.("(pointer: coarse)").matches ?? false;
    // Each of these waits for the graphics card, and is a task of its own.
    await nextTask();
    const stage = new Stage(canvas, fast, ShadowUse.on(shadows, { fast, coarse }));
    await nextTask();
    // It asks for this with the first picture of a texture otherwise, and waits.
    stage.renderer.capabilities.getMaxAnisotropy();
    await Promise.all([stage.sky.mesh, usualMeshes(), ...stage.casters()].map((root) => stage.prepare(root)));
    // Who begins now does so in a task of its own, and does not wait for what is seldom needed.
    await nextTask();
    void nextTask().then(() => stage.programs.prepareAhead(rarerMeshes()));
    return stage;
  }

  /** `fast` says whether a graphics card draws. */
  private constructor(
    private readonly canvas: HTMLCanvasElement,
    fast: boolean,
    use: ShadowUse,
  ) {
    // As large as it will be: to change that later takes long.
    canvas.width = Math.max(1, Math.floor(canvas.clientWidth * this.pixelRatio()));
    canvas.height = Math.max(1, Math.floor(canvas.clientHeight * this.pixelRatio()));
    const manner = { alpha: true, antialias: fast, powerPreference: "high-performance" } as const;
    // three.js writes to the console, several times, where there is none; it takes this one where there is.
    if (!canvas.getContext("webgl2", manner)) throw new NoWebGlError();
    this.renderer = new WebGLRenderer({ canvas, antialias: fast, powerPreference: "high-performance" });
    this.renderer.toneMapping = ACESFilmicToneMapping;
    this.renderer.toneMappingExposure = 1.05;
    this.camera.rotation.order = "YXZ";
    // It stands at the origin; else three.js takes all that is in it for moved, in each picture.
    this.scene.matrixAutoUpdate = false;
    // What is wrong with a program is said where it is prepared: to ask while one draws takes a while.
    this.renderer.debug.checkShaderErrors = false;
    if (use.starts) this.shadows = new Shadows(this.renderer, this.sun, use);
    this.programs = new Programs(this.renderer, this.scene, this.camera);
    this.renderer.domElement.addEventListener("webglcontextlost", () => {
      this.losses += 1;
    });
    this.fill(this.pixelRatio());
    this.light();
  }

  /** Calls back when the graphics card is lost to the page, which nobody can draw on meanwhile. */
  onLost(tell: () => void): void {
    this.renderer.domElement.addEventListener("webglcontextlost", tell);
  }

  /** Calls back when the graphics card, which had been lost to the page, can draw again; the picture is empty until then. */
  onRestored(draw: () => void): void {
    this.renderer.domElement.addEventListener("webglcontextrestored", async () => {
      if (await this.renew()) draw();
    });
  }

  add(object: Object3D): void {
    this.scene.add(object);
  }

  /** Waits until what is below a node, in the picture or not, can be drawn without waiting. */
  prepare(root: Object3D): Promise<void> {
    return this.programs.prepare(root);
  }

  /** Fits the near and the far plane, and the haze, to a world. */
  fit(bounds: Bounds): void {
    const across_m = diagonal_m(bounds);
    this.extent_m.across = across_m;
    this.least_m = {
      near: across_m > 0 ? Math.min(NEAR_M, NEAR_SHARE * across_m) : NEAR_M,
      far: Math.max(200, across_m * 2),
    };
    this.sky.fit(across_m, bounds.min[1]);
    this.reach(0, 0);
  }

  /** So near something must be to matter to {@link reach}. */
  get nearAt_m(): number {
    return this.least_m.near / NEAR_OF_CLEARANCE;
  }

  /**
   * Draws what is as near and as far as this. Depths tell apart what is `z² / (near · 2²⁴)` m apart: from 30 km and with the near plane of
   * a person, what is closer together than 900 m would be seen through each other.
   */
  reach(nearest_m: number, furthest_m: number): void {
    const { camera, least_m } = this;
    this.extent_m.clearance = nearest_m;
    const far = Math.max(least_m.far, furthest_m);
    const near = Math.min(Math.max(least_m.near, NEAR_OF_CLEARANCE * nearest_m), far * NEAR_OF_CLEARANCE);
    if (near === camera.near && far === camera.far) return;
    [camera.near, camera.far] = [near, far];
    camera.updateProjectionMatrix();
  }

  /**
   * Fits the picture to the canvas and, while it moves, to what the machine can draw in time; answers whether its size
   * changed.
   */
  resize(motion: "moving" | "still"): boolean {
    const ratio = this.pixelRatio() * (motion === "moving" ? this.movingScale : 1);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const changed =
      this.canvas.width !== Math.floor(width * ratio) || this.canvas.height !== Math.floor(height * ratio);
    if (!changed) return false;
    return this.fill(ratio);
  }

  /** Fits the picture to the canvas, with so many pixels for each of the page; answers whether it has any. */
  private fill(ratio: number): boolean {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return false;
    this.renderer.setDrawingBufferSize(width, height, ratio);
    this.camera.aspect = width / height;
    this.shift();
    this.camera.updateProjectionMatrix();
    return true;
  }

  /** From now on what is straight ahead is in the middle of what is not covered; of the picture, when nothing is said to be. */
  lookBeside(covered?: () => Covered): void {
    this.covered = covered;
    this.shift();
  }

  private shift(): void {
    const { width, height } = this.size;
    const { right_px, bottom_px } = this.covered?.() ?? { right_px: 0, bottom_px: 0 };
    if (right_px > 0 || bottom_px > 0) {
      this.camera.setViewOffset(width, height, right_px / 2, bottom_px / 2, width, height);
    } else if (this.camera.view) this.camera.clearViewOffset();
  }

  /** Has the shadow map drawn anew, soon: what casts shadows has changed. */
  recast(): void {
    this.shadows?.changed();
  }

  /** Draws some of the shadow map, when there is something to draw, as `Shadows.draw`; answers whether a new picture should be drawn. */
  cast(now_ms: number, casting: Iterable<Casting>): boolean {
    const { x, y, z } = this.camera.position;
    const { across, clearance } = this.extent_m;
    const look = { eye: [x, y, z] as const, across_m: across, clearance_m: clearance };
    return !this.isRenewing && (this.shadows?.draw(now_ms, look, casting) ?? false);
  }

  private casters(): Object3D[] {
    return this.shadows ? [this.shadows.sample()] : [];
  }

  /** Gives the graphics card back. */
  close(): void {
    this.shadows?.dispose();
    this.scene.environment?.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  /** Draws nothing above a height, as soon as that can be drawn without waiting; `undefined` draws everything. */
  async cutAbove(height_m: number | undefined): Promise<void> {
    this.top_m = height_m;
    this.shadows?.leaveOut(height_m !== undefined);
    if (height_m === undefined) {
      this.programs.endCut();
      this.renderer.clippingPlanes = [];
      return;
    }
    try {
      await this.programs.prepareToCut();
    } catch (error) {
      console.error("what is cut off cannot be prepared", error);
    }
    // One may have thought better of it meanwhile.
    if (this.top_m === height_m) this.renderer.clippingPlanes = [new Plane(new Vector3(0, -1, 0), height_m)];
  }

  /** The height above which nothing is drawn. */
  get cutHeight_m(): number | undefined {
    return this.top_m;
  }

  /** Puts the camera where the eye is; `yaw` and `pitch` as the walker has them. */
  aim(position: Vec3, yaw: number, pitch: number): void {
    this.camera.position.set(...position);
    this.camera.rotation.set(pitch, yaw, 0);
    this.sky.seeFrom(position[1]);
  }

  /** The ray from the eye through a point of the canvas, in CSS pixels. */
  ray(x: number, y: number): Raycaster {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2((2 * x) / width - 1, 1 - (2 * y) / height), this.camera);
    return ray;
  }

  /** Of the canvas, in CSS pixels. */
  get size(): { width: number; height: number } {
    return { width: this.canvas.clientWidth, height: this.canvas.clientHeight };
  }

  /** Corners of the far side of the picture at a distance, counter-clockwise from below left. */
  corners(distance_m: number): Vec3[] {
    const up_m = distance_m * Math.tan((this.camera.fov * Math.PI) / 360);
    const right_m = up_m * this.camera.aspect;
    this.camera.updateMatrixWorld();
    return [
      [-1, -1],
      [1, -1],
      [1, 1],
      [-1, 1],
    ].map(([x = 0, y = 0]) => {
      const corner = new Vector3(x * right_m, y * up_m, -distance_m).applyMatrix4(this.camera.matrixWorld);
      return [corner.x, corner.y, corner.z];
    });
  }

  /** What can be in the picture. */
  get view(): ViewVolume {
    this.camera.updateMatrixWorld();
    return new ViewVolume(this.camera);
  }

  /** The eye as the scheduler needs it. */
  eye(position: Vec3): Eye {
    const height_px = Math.max(1, this.canvas.clientHeight * this.pixelRatio());
    return { position, viewAngle_rad: (this.camera.fov * Math.PI) / 180, height_px };
  }

  /** Draws. `frame_ms` is how long the frame before took when it was one of the same motion, else `undefined`. */
  render(frame_ms: number | undefined): void {
    if (frame_ms !== undefined) {
      this.movingScale = this.resolution.after(frame_ms);
      this.shadows?.after(this.movingScale);
    }
    if (this.isRenewing) return;
    this.renderer.render(this.scene, this.camera);
    const { calls, triangles } = this.renderer.info.render;
    this.drawn = { calls, triangles };
  }

  /** The picture as it is, which stays when the stage is closed; with a pixel for each of the page. */
  copy(): HTMLCanvasElement {
    const { width, height } = this.size;
    const copy = Object.assign(document.createElement("canvas"), { width, height });
    // Browsers keep what was drawn only until they have shown it.
    this.render(undefined);
    copy.getContext("2d")?.drawImage(this.canvas, 0, 0, width, height);
    return copy;
  }

  /** Has the graphics card, which has lost all of it, learn anew what it draws; answers whether it can, and was not lost again. */
  private async renew(): Promise<boolean> {
    const { losses } = this;
    this.isRenewing = true;
    try {
      await this.programs.renew();
      for (const painting of this.paintings) await this.programs.prepare(painting.sample());
    } catch (error) {
      console.error("what is drawn cannot be prepared anew", error);
    }
    if (losses !== this.losses) return false;
    this.isRenewing = false;
    this.shadows?.renew();
    for (const painting of this.paintings) painting.draw(this.renderer);
    return true;
  }

  private pixelRatio(): number {
    return Math.min(globalThis.devicePixelRatio, MAX_PIXEL_RATIO);
  }

  /** Triangles of the last picture. */
  get triangles(): number {
    return this.drawn.triangles;
  }

  /** Draw calls of the last picture. */
  get drawCalls(): number {
    return this.drawn.calls;
  }

  /** Has pictures drawn before the next one. */
  paint(painting: Painting): void {
    this.paintings.push(painting);
    painting.draw(this.renderer);
  }

  private light(): void {
    this.scene.environment = skylight();
    this.scene.environmentIntensity = SKYLIGHT;
    this.scene.add(this.sun, lamp(FILL), this.sky.mesh);
    this.scene.fog = this.sky.haze;
  }
}

/** Whether this browser draws with a graphics card rather than on the processor. */
function hasFastGraphics(): boolean {
  const context = document.createElement("canvas").getContext("webgl2", { failIfMajorPerformanceCaveat: true });
  if (!context) return false;
  const names = context.getExtension("WEBGL_debug_renderer_info");
  const renderer = String(context.getParameter(names?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER));
  context.getExtension("WEBGL_lose_context")?.loseContext();
  // Some browsers draw in software without calling that a caveat.
  return !/swiftshader|llvmpipe|softpipe|software|basic render/i.test(renderer);
}
