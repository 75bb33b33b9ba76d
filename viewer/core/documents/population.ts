/**
 * Which grown models stand where? Decodes a population (`.pop`, `docs/FORMAT.md`): rules once, what to make of them, and for
 * each member what it grew from and where it stands (Schmalstieg, *The Remote Rendering Pipeline*, 1997, §8.4).
 */
import { DocumentError, Json } from "../basics/json.ts";
import { readFile } from "./impostordocument.ts";
import { type Rules, readImports, readMaking } from "./rulesdocument.ts";

/** What members grew from. */
export interface Recipe {
  readonly model: number;
  readonly rules: Rules;
}

/** An object that can be grown. */
export interface Member {
  readonly object: number;
  readonly recipe: Recipe;
  /** `world_from_object`, column-major. */
  readonly worldFromObject: readonly number[];
  readonly scale: number;
}

/** The run of ids that the index says it is of. */
export interface Run {
  readonly first: number;
  readonly count: number;
}

const MAGIC = [0x42, 0x56, 0x50, 0x4f];
const VERSION = 1;
/** Magic, version, two bytes of nothing, length of the head. */
const FRONT_BYTES = 12;
/** Of one member in all arrays. */
const MEMBER_BYTES = 28;

/** The members, rising by object. `place` names the file in errors. */
export function decodePopulation(bytes: ArrayBuffer, run: Run, place: string): Member[] {
  const view = new DataView(bytes);
  const isOne = bytes.byteLength >= FRONT_BYTES && MAGIC.every((byte, i) => view.getUint8(i) === byte);
  if (!isOne || view.getUint16(4, true) !== VERSION) {
    throw new DocumentError(place, `a population of version ${VERSION}`);
  }
  const arrays_at = FRONT_BYTES + view.getUint32(8, true);
  if (arrays_at > bytes.byteLength) throw wrongLength(place, arrays_at, bytes);
  const head = Json.parse(new TextDecoder().decode(new Uint8Array(bytes, FRONT_BYTES, arrays_at - FRONT_BYTES)), place);
  const count = head.field("count").count();
  const expected = arrays_at + MEMBER_BYTES * count;
  if (expected !== bytes.byteLength) throw wrongLength(place, expected, bytes);
  const recipes = readRecipes(head);
  const origin = head.field("origin").vec3();
  const arrays = new Arrays(new DataView(bytes, arrays_at), count);
  const members: Member[] = [];
  for (let i = 0; i < count; i += 1) {
    const [number, recipe] = [arrays.number(i), recipes[arrays.recipe(i)]];
    const object = run.first + number;
    const scale = arrays.scale(i);
    const at = arrays.fromOrigin(i).map((x, axis) => x + (origin[axis] ?? 0));
    const worldFromObject = transformOf(at, arrays.rotation(i), scale);
    const rises = object > (members.at(-1)?.object ?? -1) && number < run.count;
    if (!recipe || !rises || !(scale > 0) || !worldFromObject.every(Number.isFinite)) {
      throw new DocumentError(
        `${place}: member ${i}`,
        "an object of its run, after the one before, that stands somewhere",
      );
    }
    members.push({ object, recipe, worldFromObject, scale });
  }
  return members;
}

function wrongLength(place: string, expected: number, { byteLength }: ArrayBuffer): DocumentError {
  return new DocumentError(place, `${expected} bytes long, and not ${byteLength}`);
}

function readRecipes(head: Json): Recipe[] {
  const files = head.field("rules").list((rules) => ({
    file: readFile(rules),
    imports: readImports(rules),
  }));
  return head.field("recipes").list((recipe) => ({
    model: recipe.field("model").id("m"),
    rules: {
      ...(files[recipe.field("rules").count()] ?? recipe.field("rules").fail("a place in the list of rules")),
      ...readMaking(recipe),
      triangles: recipe.field("triangles").count(),
      // As fine as the source, as far as anybody knows yet.
      geometricError: 0,
    },
  }));
}

/** The arrays of members, one after the other. */
class Arrays {
  constructor(
    private readonly view: DataView,
    private readonly count: number,
  ) {}

  fromOrigin(i: number): number[] {
    return [0, 4, 8].map((byte) => this.view.getFloat32(12 * i + byte, true));
  }

  scale(i: number): number {
    return this.view.getFloat32(12 * this.count + 4 * i, true);
  }

  /** A quaternion x, y, z, w of any length. */
  rotation(i: number): number[] {
    return [0, 2, 4, 6].map((byte) => this.view.getInt16(16 * this.count + 8 * i + byte, true));
  }

  recipe(i: number): number {
    return this.view.getUint16(24 * this.count + 2 * i, true);
  }

  /** The object, counted from the first of the run. */
  number(i: number): number {
    return this.view.getUint16(26 * this.count + 2 * i, true);
  }
}

/** Moves, turns and scales, column-major. */
function transformOf([px = 0, py = 0, pz = 0]: readonly number[], rotation: readonly number[], s: number): number[] {
  const length = Math.hypot(...rotation);
  const [x = 0, y = 0, z = 0, w = 0] = rotation.map((component) => component / length);
  return [
    [s * (1 - 2 * (y * y + z * z)), s * 2 * (x * y + z * w), s * 2 * (x * z - y * w), 0],
    [s * 2 * (x * y - z * w), s * (1 - 2 * (x * x + z * z)), s * 2 * (y * z + x * w), 0],
    [s * 2 * (x * z + y * w), s * 2 * (y * z - x * w), s * (1 - 2 * (x * x + y * y)), 0],
    [px, py, pz, 1],
  ].flat();
}
