/** What does a live session tell? The events of docs/LIVE.md as values; what they hold beyond that is ignored. */
import type { Vec3 } from "../basics/geometry.ts";
import { Json } from "../basics/json.ts";
import { type Impostor, readImpostor } from "../documents/impostordocument.ts";
import type { MoverPose } from "./motion.ts";

export type LiveEvent =
  | { readonly kind: "hello"; readonly now_ms: number; readonly extrapolate_ms: number; readonly revision: string }
  | {
      readonly kind: "appear";
      readonly object: number;
      readonly name: string;
      readonly pose: MoverPose;
      readonly radius_m: number;
      readonly period_ms: number;
      readonly worn: Worn | undefined;
    }
  | { readonly kind: "move"; readonly poses: readonly { readonly object: number; readonly pose: MoverPose }[] }
  | {
      readonly kind: "vanish";
      readonly objects: readonly number[];
      /** They are only hidden, and may be told of again without an info. */
      readonly mayReturn: boolean;
    }
  | { readonly kind: "rate"; readonly periods: readonly { readonly object: number; readonly period_ms: number }[] }
  | { readonly kind: "hush"; readonly hush: Hush }
  | { readonly kind: "wake" }
  | { readonly kind: "door"; readonly object: number; readonly open: boolean }
  | { readonly kind: "revision"; readonly revision: string }
  | { readonly kind: "resync" }
  /** Not of the server: nothing is heard of it for a while. */
  | { readonly kind: "silence" };

/** Pictures of the model that a mover wears. */
export interface Worn {
  readonly impostor: Impostor;
  /** How large the model is, along its axes. */
  readonly scale: Vec3;
}

/** Nobody may see one's own mover: it need not speak while it keeps to this ball, until then by its own clock. */
export interface Hush {
  readonly center: readonly [number, number, number];
  readonly radius_m: number;
  readonly until_ms: number;
}

/** The events that are understood, by the names that they have on the wire. */
export const EVENT_NAMES = [
  "hello",
  "object-info",
  "object-pos",
  "object-gone",
  "rate",
  "hush",
  "wake",
  "door",
  "revision",
  "resync",
] as const;

/** Reads an event; `undefined` for a static object, which clients that read cell records know already. */
export function readEvent(name: (typeof EVENT_NAMES)[number], data: string): LiveEvent | undefined {
  const json = Json.parse(data, `the event ${name}`);
  switch (name) {
    case "hello":
      return {
        kind: "hello",
        now_ms: json.field("now_ms").number(),
        extrapolate_ms: json.field("extrapolate_ms").number(),
        revision: json.field("revision").text(),
      };
    case "object-info": {
      const pose = json.field("pose").optional(readPose);
      if (!pose) return undefined;
      return {
        kind: "appear",
        object: json.field("object").id("o"),
        name: json.field("source_node").optional((text) => text.text()) ?? "",
        pose,
        radius_m: json.field("radius_m").number(),
        period_ms: json.field("period_ms").number(),
        worn: readWorn(json),
      };
    }
    case "object-pos":
      return {
        kind: "move",
        poses: json.field("objects").list((one) => ({ object: one.field("object").id("o"), pose: readPose(one) })),
      };
    case "object-gone":
      return {
        kind: "vanish",
        objects: json.field("objects").list((id) => id.id("o")),
        mayReturn: json.field("reason").text() === "hidden",
      };
    case "rate":
      return {
        kind: "rate",
        periods: json
          .field("objects")
          .list((one) => ({ object: one.field("object").id("o"), period_ms: one.field("period_ms").number() })),
      };
    case "hush":
      return { kind: "hush", hush: readHush(json) };
    case "wake":
      return { kind: "wake" };
    case "door":
      return { kind: "door", object: json.field("object").id("o"), open: json.field("open").boolean() };
    case "revision":
      return { kind: "revision", revision: json.field("revision").text() };
    case "resync":
      return { kind: "resync" };
  }
}

export function readHush(json: Json): Hush {
  const tbv = json.field("tbv");
  return {
    center: tbv.field("center").vec3(),
    radius_m: tbv.field("radius_m").number(),
    until_ms: json.field("until_ms").number(),
  };
}

/** A model without pictures is not drawn for a mover. */
function readWorn(json: Json): Worn | undefined {
  const impostor = json.field("impostor").optional(readImpostor);
  if (!impostor) return undefined;
  const matrix = json.field("transform").numbers(16);
  const axis = (i: number) => Math.hypot(...matrix.slice(4 * i, 4 * i + 3));
  return { impostor, scale: [axis(0), axis(1), axis(2)] };
}

function readPose(json: Json): MoverPose {
  const [x = 0, y = 0, z = 0, w = 1] = json.field("orientation").numbers(4);
  return {
    t_ms: json.field("t_ms").number(),
    position: json.field("position").vec3(),
    orientation: [x, y, z, w],
    velocity: json.field("velocity").vec3(),
    acceleration: json.field("acceleration").optional((a) => a.vec3()) ?? [0, 0, 0],
  };
}
