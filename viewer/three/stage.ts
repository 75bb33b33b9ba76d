/**
 * What does the picture look like? Renderer, camera, light and sky: soft light from above, a faint room environment so
 * that metals have something to reflect, and a quiet gradient where there is no geometry. Draws only when asked.
 */
import {
  ACESFilmicToneMapping,
  CanvasTexture,
  Color,
  DirectionalLight,
  EquirectangularReflectionMapping,
  HemisphereLight,
  type Object3D,
  PerspectiveCamera,
  PMREMGenerator,
  Scene,
  SRGBColorSpace,
  WebGLRenderer,
} from "three";
import { RoomEnvironment } from "three/addons/environments/RoomEnvironment.js";
import type { Bounds, Vec3 } from "../core/geometry.ts";
import type { Eye } from "../core/scheduler.ts";

const VIEW_ANGLE_DEG = 62;
const NEAR_M = 0.06;
const MAX_PIXEL_RATIO = 2;

/** This browser or machine cannot draw with WebGL. */
export class NoWebGlError extends Error {
  override readonly name = "NoWebGlError";
}

export class Stage {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(VIEW_ANGLE_DEG, 1, NEAR_M, 2000);
  private readonly renderer: WebGLRenderer;

  constructor(private readonly canvas: HTMLCanvasElement) {
    try {
      this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    } catch (error) {
      throw new NoWebGlError(String(error));
    }
    this.renderer.toneMapping = ACESFilmicToneMapping;
    this.renderer.toneMappingExposure = 1.05;
    this.camera.rotation.order = "YXZ";
    this.light();
  }

  add(object: Object3D): void {
    this.scene.add(object);
  }

  /** Fits the far plane to a world. */
  fit(bounds: Bounds): void {
    const diagonal_m = Math.hypot(...[0, 1, 2].map((axis) => (bounds.max[axis] ?? 0) - (bounds.min[axis] ?? 0)));
    this.camera.far = Math.max(200, diagonal_m * 2);
    this.camera.updateProjectionMatrix();
  }

  /** Fits the picture to the canvas; answers whether its size changed. */
  resize(): boolean {
    const ratio = Math.min(globalThis.devicePixelRatio, MAX_PIXEL_RATIO);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const changed =
      this.canvas.width !== Math.floor(width * ratio) || this.canvas.height !== Math.floor(height * ratio);
    if (!changed || width === 0 || height === 0) return false;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    return true;
  }

  /** Puts the camera where the eye is; `yaw` and `pitch` as the walker has them. */
  aim(position: Vec3, yaw: number, pitch: number): void {
    this.camera.position.set(...position);
    this.camera.rotation.set(pitch, yaw, 0);
  }

  /** The eye as the scheduler needs it. */
  eye(position: Vec3): Eye {
    return { position, viewAngle_rad: (this.camera.fov * Math.PI) / 180, height_px: Math.max(1, this.canvas.height) };
  }

  render(): void {
    this.renderer.render(this.scene, this.camera);
  }

  /** Triangles of the last picture. */
  get triangles(): number {
    return this.renderer.info.render.triangles;
  }

  private light(): void {
    const room = new RoomEnvironment();
    const generator = new PMREMGenerator(this.renderer);
    this.scene.environment = generator.fromScene(room, 0.04).texture;
    this.scene.environmentIntensity = 0.4;
    generator.dispose();
    room.dispose();
    this.scene.background = sky();
    this.scene.add(new HemisphereLight(new Color(0xe3ebf5), new Color(0x7d6f5f), 0.9));
    // Two lights from unequal sides, so that walls of every direction differ in tone.
    const sun = new DirectionalLight(new Color(0xfff0d9), 1.7);
    sun.position.set(0.5, 1, 0.3);
    const fill = new DirectionalLight(new Color(0xbfd4f2), 0.6);
    fill.position.set(-0.7, 0.35, -0.4);
    this.scene.add(sun, fill);
  }
}

/** A gradient from horizon haze to a deep zenith, painted once. */
function sky(): CanvasTexture {
  const canvas = document.createElement("canvas");
  canvas.width = 8;
  canvas.height = 512;
  const pen = canvas.getContext("2d");
  if (pen) {
    const gradient = pen.createLinearGradient(0, 0, 0, canvas.height);
    gradient.addColorStop(0, "#3d5f8c");
    gradient.addColorStop(0.38, "#8fadc8");
    gradient.addColorStop(0.5, "#d9dfe1");
    gradient.addColorStop(0.54, "#8c8a86");
    gradient.addColorStop(1, "#3b3a3a");
    pen.fillStyle = gradient;
    pen.fillRect(0, 0, canvas.width, canvas.height);
  }
  const texture = new CanvasTexture(canvas);
  texture.mapping = EquirectangularReflectionMapping;
  texture.colorSpace = SRGBColorSpace;
  return texture;
}
