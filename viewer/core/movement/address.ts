/**
 * What does the page's address say? The query names the scene and the tree; the hash carries the pose, so that a link
 * shows another person what one sees.
 */
import type { Vec3 } from "../basics/geometry.ts";

export interface Pose {
  readonly position: Vec3;
  /** Radians; 0 looks towards −Z, positive turns left. */
  readonly yaw: number;
  /** Radians, positive upwards. */
  readonly pitch: number;
  /** Whether one flies there or walks; unless given, as one did before. */
  readonly mode?: Mode | undefined;
}

export type Mode = "fly" | "walk";

/** `#p=x,y,z&yaw=…&pitch=…&mode=fly&rev=…`, millimetres, hundredths of a degree, how one moves unless one walks, and the revision that was seen. */
export function writePose({ position, yaw, pitch, mode }: Pose, revision?: string): string {
  const degrees = (angle: number) => ((angle * 180) / Math.PI).toFixed(2);
  const fields = [`p=${position.map((x) => x.toFixed(3)).join(",")}`, `yaw=${degrees(yaw)}`, `pitch=${degrees(pitch)}`];
  if (mode === "fly") fields.push("mode=fly");
  if (revision !== undefined) fields.push(`rev=${revision}`);
  return `#${fields.join("&")}`;
}

/** The same page and pose, in whatever revision there is. */
export function withoutRevision(page: string): string {
  const url = new URL(page);
  const fields = url.hash.replace(/^#/, "").split("&");
  url.hash = fields.filter((field) => !field.startsWith("rev=")).join("&");
  return url.href;
}

/** The revision that somebody saw who made a link, when it says so. */
export function readRevision(hash: string): string | undefined {
  return new URLSearchParams(hash.replace(/^#/, "")).get("rev") ?? undefined;
}

/** The pose of a hash, or `undefined` when it holds none that makes sense. Who is not said to fly walks. */
export function readPose(hash: string): Pose | undefined {
  const fields = new URLSearchParams(hash.replace(/^#/, ""));
  const [x, y, z, more] = (fields.get("p") ?? "").split(",").map((text) => (text === "" ? Number.NaN : Number(text)));
  const angle = (name: string) => (Number(fields.get(name) ?? 0) * Math.PI) / 180;
  const [yaw, pitch] = [angle("yaw"), angle("pitch")];
  if (x === undefined || y === undefined || z === undefined || more !== undefined) return undefined;
  const mode = fields.get("mode") === "fly" ? "fly" : "walk";
  return [x, y, z, yaw, pitch].every(Number.isFinite) ? { position: [x, y, z], yaw, pitch, mode } : undefined;
}

/** Whether a hash says of a pose what makes no sense. */
export function isPoseBroken(hash: string): boolean {
  return new URLSearchParams(hash.replace(/^#/, "")).has("p") && readPose(hash) === undefined;
}

/** Yaw and pitch of a unit quaternion x, y, z, w whose identity looks along −Z. */
export function anglesOf(orientation: readonly number[]): { yaw: number; pitch: number } {
  const [x = 0, y = 0, z = 0, w = 1] = orientation;
  const ahead: Vec3 = [-2 * (x * z + w * y), -2 * (y * z - w * x), -(1 - 2 * (x * x + y * y))];
  return { yaw: Math.atan2(-ahead[0], -ahead[2]), pitch: Math.asin(Math.min(1, Math.max(-1, ahead[1]))) };
}

/** The unit quaternion x, y, z, w of who looks so: turned about the vertical first, then raised. */
export function orientationOf(yaw: number, pitch: number): [number, number, number, number] {
  const [sinYaw, cosYaw] = [Math.sin(yaw / 2), Math.cos(yaw / 2)];
  const [sinPitch, cosPitch] = [Math.sin(pitch / 2), Math.cos(pitch / 2)];
  return [cosYaw * sinPitch, sinYaw * cosPitch, -sinYaw * sinPitch, cosYaw * cosPitch];
}

/** What should name a tree is not the address of one. */
export class NoWebAddressError extends Error {
  override readonly name = "NoWebAddressError";

  constructor(readonly base: string) {
    super(`"${base}" is not a web address`);
  }
}

/** The tree that a page shows: the one named by `?base=`, else the folder in which the page lies. */
export function treeBase(page: string): string {
  const named = new URL(page).searchParams.get("base") ?? ".";
  const base = URL.canParse(named, page) ? new URL(named, page) : undefined;
  if (base?.protocol !== "http:" && base?.protocol !== "https:") throw new NoWebAddressError(named);
  return base.href;
}

/** The same page with another scene, without a pose. */
export function addressOfScene(page: string, scene: string): string {
  const url = new URL(page);
  url.searchParams.set("scene", scene);
  url.hash = "";
  return url.href;
}
