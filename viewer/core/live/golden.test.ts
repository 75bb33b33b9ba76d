import { readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it } from "vitest";
import { Json } from "../basics/json.ts";
import { readImpostor } from "../documents/impostordocument.ts";
import { EVENT_NAMES, readEvent } from "./events.ts";

/** What the server writes, and what the client in Rust understands of it. */
const GOLDEN = join(import.meta.dirname, "../../../tests/golden/live");

interface Written {
  readonly case: string;
  readonly event: string;
  readonly data: string;
}

type Value = Readonly<Record<string, unknown>>;

interface Understood {
  readonly case: string;
  readonly event: Value | null;
}

const read = <T>(name: string) => JSON.parse(readFileSync(join(GOLDEN, name), "utf8")) as readonly T[];
const written = read<Written>("events.json");
const understood = new Map(read<Understood>("understood.json").map((one) => [one.case, one.event]));

/** A pick of members. */
function only(value: unknown, ...names: string[]): Value {
  return Object.fromEntries(names.map((name) => [name, (value as Value)[name]]));
}

const number = (id: unknown) => Number(String(id).slice(1));
const list = (value: unknown) => value as readonly Value[];

/** What the viewer draws of a model: pictures, as large as the matrix makes them. */
function worn(info: Value): unknown {
  if (info.impostor === undefined) return undefined;
  const [x, y, z] = [0, 4, 8].map((at) => Math.hypot(...(info.transform as number[]).slice(at, at + 3)));
  return { impostor: readImpostor(Json.parse(JSON.stringify(info.impostor), "it")), scale: [x, y, z] };
}

/** What the client in Rust understands, as far as the viewer needs to know it. */
function needed(event: Value): unknown {
  const { kind } = event;
  switch (kind) {
    case "hello":
      return { kind, ...only(event, "now_ms", "extrapolate_ms", "revision") };
    case "appear": {
      const info = event.info as Value;
      return {
        kind,
        object: number(info.object),
        name: info.source_node,
        ...only(event, "pose", "radius_m"),
        ...only(event.attention, "period_ms"),
        worn: worn(info),
      };
    }
    case "move":
      return { kind, poses: list(event.poses).map(({ object, pose }) => ({ object: number(object), pose })) };
    case "vanish":
      return { kind, objects: (event.objects as unknown[]).map(number), mayReturn: event.reason === "hidden" };
    case "rate":
      return {
        kind,
        periods: list(event.rates).map(({ object, attention }) => ({
          object: number(object),
          ...only(attention, "period_ms"),
        })),
      };
    case "hush":
      return { kind, hush: only(event, "center", "radius_m", "until_ms") };
    case "door":
      return { kind, object: number(event.object), open: event.open };
    default:
      return event;
  }
}

const isKnown = (name: string): name is (typeof EVENT_NAMES)[number] =>
  (EVENT_NAMES as readonly string[]).includes(name);

describe("events of a live session", () => {
  it("are all known by name, but for where one is and whether nodes hear each other", () => {
    const names = new Set(written.map(({ event }) => event));
    expect([...names].filter((name) => !isKnown(name))).toEqual(["cell", "network"]);
    expect(EVENT_NAMES.filter((name) => !names.has(name))).toEqual([]);
  });

  it.each(written.filter(({ event }) => isKnown(event)))("mean what they mean in Rust: $case", (one) => {
    const event = understood.get(one.case);
    const mine = isKnown(one.event) ? readEvent(one.event, one.data) : undefined;
    expect(event).toBeDefined();
    expect(mine).toEqual(event ? needed(event) : undefined);
  });

  it.each(written.filter(({ event }) => isKnown(event)))("are refused when they are cut off: $case", (one) => {
    const isRead = (text: string) => {
      try {
        return isKnown(one.event) && readEvent(one.event, text) !== undefined;
      } catch {
        return false;
      }
    };
    const cuts = Array.from({ length: one.data.length }, (_, end) => one.data.slice(0, end));
    expect(cuts.filter(isRead)).toEqual([]);
  });
});
