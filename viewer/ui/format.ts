/** How are numbers, doors and people written for people? */
import type { Progress } from "../core/strategy/progress.ts";
import type { Shares } from "../core/strategy/visible.ts";

const UNITS = ["B", "kB", "MB", "GB", "TB"];
/** The largest first. */
const LENGTHS = [
  ["km", 1000],
  ["m", 1],
  ["cm", 0.01],
] as const;
/** So many people are named. */
const MOST_NAMES = 6;

/** Decimal units with at most one place behind the point: `1.2 MB`. */
export function writeBytes(bytes: number): string {
  let value = bytes;
  let unit = 0;
  while (value >= 999.5 && unit < UNITS.length - 1) {
    value /= 1000;
    unit += 1;
  }
  const text = unit === 0 ? String(Math.round(value)) : value.toFixed(value < 99.95 ? 1 : 0);
  return `${text} ${UNITS[unit]}`;
}

/** What was fetched against the whole scene: `1.2 MB of 35.4 MB · 3.4 %`. */
export function writeShare(fetched: number, whole: number | undefined): string {
  if (!whole) return writeBytes(fetched);
  const percent = (100 * fetched) / whole;
  return `${writeBytes(fetched)} of ${writeBytes(whole)} · ${percent.toFixed(percent < 10 ? 1 : 0)} %`;
}

/** How much is here of what one can see: `3.1 MB of 4.0 MB`, with a word where either is not exact. */
export function writeProgress({ loaded_bytes, isAbout, total_bytes, bound }: Progress): string {
  const total = { exact: "", least: "at least ", most: "at most " }[bound] + writeBytes(total_bytes);
  return `${isAbout ? "about " : ""}${writeBytes(loaded_bytes)} of ${total}`;
}

/** Why a sharp picture may take less than the first one, which counts coarsest levels whatever stands for them; nothing where it does not. */
export function writeStandIns(first: Progress | undefined, sharp: Progress | undefined): string {
  if (!first || !sharp || sharp.total_bytes >= first.total_bytes) return "";
  return "The first picture is counted in coarsest levels; less stands for some of them here, also when all is sharp.";
}

/** How much of so many visible objects is here: `98.0 % here, 75.5 % sharp`. */
export function writeQuality(shares: Shares | undefined, visible: number | undefined): string {
  if (visible === 0) return "nothing in sight";
  if (!shares) return "looking around";
  return `${(100 * shares.here).toFixed(1)} % here, ${(100 * shares.sharp).toFixed(1)} % sharp`;
}

/** How many of all objects are visible, as far as anybody knows. */
export function writeVisible(visible: number | undefined, objects: number): string {
  return `${visible ?? "–"} of ${objects} objects visible`;
}

/** A length in the unit that suits it, with at most two digits that are not zero: `25 mm`, `1.5 km`. */
export function writeLength(length_m: number): string {
  const rounded_m = Number(length_m.toPrecision(2));
  const [unit, metres] = LENGTHS.find(([, least_m]) => rounded_m >= least_m) ?? ["mm", 0.001];
  return `${Number((rounded_m / metres).toPrecision(2))} ${unit}`;
}

/** Minutes and seconds: `0:07`, `61:30`. */
export function writeTime(time_ms: number): string {
  const seconds = Math.floor(time_ms / 1000);
  return `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;
}

/** Whole seconds: `20 s`. */
export function writeSeconds(time_ms: number): string {
  return `${Math.round(time_ms / 1000)} s`;
}

/** A text with addresses of published files in it, each by the first digits of its name and its kind: `o/77ac0f84….glb`. */
export function shorten(text: string): string {
  return text.replaceAll(/[^\s"“]*\/o\/([0-9a-f]{8})[0-9a-f]{8,}((?:\.[a-z0-9]+)*)/g, "o/$1…$2");
}

/** Who else is in sight, by their names; of who has none it is empty: `3 people in sight: Ada, Ben, and 1 more`. */
export function writePeople(names: readonly string[]): string {
  if (names.length === 0) return "Nobody else in sight";
  const count = `${names.length === 1 ? "1 person" : `${names.length} people`} in sight`;
  const named = names.filter((name) => name.trim() !== "").sort();
  const first = named.slice(0, MOST_NAMES);
  if (first.length === 0) return count;
  const others = names.length - first.length;
  return `${count}: ${[...first, ...(others > 0 ? [`and ${others} more`] : [])].join(", ")}`;
}

/** A door by its name in the source: `door “front”`, `door 3`, `Front door`; `the door` when it has none. */
export function writeDoor(sourceNode: string): string {
  const name = sourceNode
    .replace(/^door:?\s*/i, "")
    .replaceAll("_", " ")
    .trim();
  if (name === "") return "the door";
  if (/\bdoor\b/i.test(name)) return name;
  return /^\d+$/.test(name) ? `door ${name}` : `door “${name}”`;
}
