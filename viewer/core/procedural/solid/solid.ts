/** What can be seen of a model? Its terminals, with their numbers checked. As `crates/scene/src/procedural/solid`. */
import type { Vector } from "../affine.ts";
import { type Heights, writeBox, writeHeights, writeMesh, writePrism } from "./flat.ts";
import type { Corner } from "./polygon.ts";
import { writeCone, writeLathe, writeSphere } from "./round.ts";
import type { Writer } from "./writer.ts";

export type Solid =
  | { readonly kind: "box"; readonly size: Vector }
  | {
      readonly kind: "cone";
      readonly low: number;
      readonly high: number;
      readonly height: number;
      readonly sides: number;
      readonly closed: boolean;
    }
  | { readonly kind: "sphere"; readonly radius: number; readonly sides: number }
  | { readonly kind: "lathe"; readonly profile: readonly Corner[]; readonly sides: number; readonly smooth: boolean }
  | { readonly kind: "prism"; readonly footprint: readonly Corner[]; readonly height: number }
  | { readonly kind: "mesh"; readonly points: readonly Vector[]; readonly faces: readonly (readonly number[])[] }
  | ({ readonly kind: "heights" } & Heights);

/** Adds its triangles. */
export function writeSolid(writer: Writer, solid: Solid): void {
  switch (solid.kind) {
    case "box":
      writeBox(writer, solid.size);
      break;
    case "cone":
      writeCone(writer, solid.low, solid.high, solid.height, solid.sides, solid.closed);
      break;
    case "sphere":
      writeSphere(writer, solid.radius, solid.sides);
      break;
    case "lathe":
      writeLathe(writer, solid.profile, solid.sides, solid.smooth);
      break;
    case "prism":
      writePrism(writer, solid.footprint, solid.height);
      break;
    case "mesh":
      writeMesh(writer, solid.points, solid.faces);
      break;
    case "heights":
      writeHeights(writer, solid);
      break;
  }
}

/** At least as many triangles as {@link writeSolid} adds. */
export function mostTriangles(solid: Solid): number {
  switch (solid.kind) {
    case "box":
      return 12;
    case "cone":
      return solid.low === 0 && solid.high === 0 ? 0 : 4 * solid.sides;
    case "sphere":
      return solid.radius === 0 ? 0 : solid.sides * solid.sides;
    case "lathe":
      return solid.profile.every(([radius]) => radius === 0) ? 0 : 2 * solid.profile.length * solid.sides;
    case "prism":
      return 4 * solid.footprint.length;
    case "mesh":
      return solid.faces.reduce((sum, face) => sum + face.length, 0);
    case "heights":
      return 2 * solid.steps[0] * solid.steps[1];
  }
}
