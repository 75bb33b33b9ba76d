/**
 * What do other people look like? Somebody in clothes of a colour of their own, who takes steps as they walk: all near people
 * are one draw call, all far ones another, by pictures. A disc under their feet tells in the inspector how often they are
 * heard of.
 */
import { Color, Group, Matrix4, Quaternion, Vector3, type WebGLRenderer } from "three";
import { length, subtract, type Vec3 } from "../core/geometry.ts";
import type { Mover } from "../core/live/company.ts";
import { colourOf, Gait, isFar, type Pose } from "../core/live/crowd.ts";
import type { Eye } from "../core/scheduler.ts";
import { Discs, FarCrowd, NearCrowd, type Somebody } from "./crowds.ts";
import { EYE_HEIGHT_M, growPerson, type Person } from "./person.ts";
import { capturePerson, pixelOf_m } from "./personcapture.ts";

/** A smaller step is not worth a new picture. */
const STEP_M = 1e-3;
/** As for objects that stand still. */
const TARGET_PX = 1.5;

/** How people are looked at. */
export interface Look {
  readonly eye: Eye;
  readonly now_ms: number;
  /** Whether discs tell how often one hears of them. */
  readonly rates: boolean;
}

/** Lets something draw pictures of its own. */
export type Paint = (work: (renderer: WebGLRenderer) => void) => void;

/** One of the people, as they were drawn last. */
interface Figure {
  readonly gait: Gait;
  readonly colour: Color;
  readonly world: Matrix4;
  far: boolean;
  drawn: { readonly mover: Mover; readonly pose: Pose } | undefined;
}

export class Avatars {
  readonly root = new Group();
  private readonly figures = new Map<number, Figure>();
  private readonly discs = new Discs(this.root);
  private crowd: { readonly person: Person; readonly near: NearCrowd } | undefined;
  private far: FarCrowd | undefined;
  private lookedFrom: Vec3 | undefined;
  private rates = false;

  constructor(private readonly paint: Paint) {}

  /** Draws these people and no others; answers whether the picture has changed. */
  show(movers: readonly Mover[], look: Look): boolean {
    if (movers.length === 0 && this.figures.size === 0) return false;
    this.crowd ??= this.grow();
    const { person } = this.crowd;
    const present = new Set(movers.map(({ object }) => object));
    const gone = [...this.figures.keys()].filter((object) => !present.has(object));
    for (const object of gone) this.figures.delete(object);
    let changed = gone.length > 0 || look.rates !== this.rates;
    for (const mover of movers) {
      const figure = this.figures.get(mover.object) ?? this.add(mover, person);
      const pose = figure.gait.step(mover.position, mover.orientation, look.now_ms);
      const distance_m = length(subtract(mover.position, look.eye.position));
      const far = isFar(distance_m, pixelOf_m(person), look.eye, TARGET_PX, figure.far);
      if (far === figure.far && isAsDrawn(figure, mover, pose)) continue;
      place(figure, mover);
      figure.far = far;
      figure.drawn = { mover, pose };
      changed = true;
    }
    this.rates = look.rates;
    if (changed) this.draw(this.crowd);
    this.turn(look.eye.position, changed);
    return changed;
  }

  private grow(): { person: Person; near: NearCrowd } {
    const person = growPerson();
    return { person, near: new NearCrowd(person, this.root) };
  }

  private add({ object }: Mover, person: Person): Figure {
    const { hue, saturation, lightness } = colourOf(object);
    const colour = new Color().setHSL(hue, saturation, lightness);
    const figure = { gait: new Gait(person), colour, world: new Matrix4(), far: false, drawn: undefined };
    this.figures.set(object, figure);
    return figure;
  }

  private draw({ person, near }: { person: Person; near: NearCrowd }): void {
    const people: [Somebody[], Somebody[]] = [[], []];
    const discs: { world: Matrix4; colour: Color }[] = [];
    for (const { colour, world, far, drawn } of this.figures.values()) {
      if (!drawn) continue;
      people[far ? 1 : 0].push({ world, colour, pose: drawn.pose });
      if (this.rates) discs.push({ world, colour: new Color(rateColour(drawn.mover.period_ms)) });
    }
    near.draw(people[0]);
    if (people[1].length > 0) this.far ??= this.capture(person);
    this.far?.draw(people[1]);
    this.discs.draw(discs);
  }

  private capture(person: Person): FarCrowd | undefined {
    let crowd: FarCrowd | undefined;
    this.paint((renderer) => {
      const { impostor, colour, shape } = capturePerson(person, renderer);
      crowd = new FarCrowd(impostor, [colour, shape], this.root);
    });
    return crowd;
  }

  /** Turns pictures to the eye. */
  private turn(eye: Vec3, changed: boolean): void {
    const moved = !this.lookedFrom || length(subtract(eye, this.lookedFrom)) > STEP_M;
    if (!moved && !changed) return;
    this.lookedFrom = eye;
    this.far?.look(eye);
  }
}

/** Green for ten times a second, over yellow, to red for once a second and less. */
export function rateColour(period_ms: number): string {
  const share = Math.min(1, Math.max(0, Math.log10(Math.max(period_ms, 1) / 100)));
  return `hsl(${Math.round(120 * (1 - share))} 65% 55%)`;
}

/** A mover's position is that of its eyes. */
function place({ world }: Figure, { position, orientation }: Mover): void {
  const turn = new Quaternion(...orientation);
  const feet = new Vector3(0, -EYE_HEIGHT_M, 0).applyQuaternion(turn).add(new Vector3(...position));
  world.compose(feet, turn, new Vector3(1, 1, 1));
}

function isAsDrawn({ drawn }: Figure, { position, orientation, period_ms }: Mover, pose: Pose): boolean {
  if (!drawn) return false;
  const { mover } = drawn;
  const near = length(subtract(position, mover.position)) < STEP_M;
  const turned = orientation.some((q, i) => Math.abs(q - (mover.orientation[i] ?? 0)) > STEP_M);
  const steps = pose.from !== drawn.pose.from || pose.to !== drawn.pose.to || pose.share !== drawn.pose.share;
  return near && !turned && !steps && mover.period_ms === period_ms;
}
