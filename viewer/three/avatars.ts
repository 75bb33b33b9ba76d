/**
 * What do other people look like? Somebody in clothes of a colour of their own, who takes steps as they walk: all near people
 * are one draw call, all far ones another, by pictures; all who wear the same model are one too. A disc under their feet tells
 * in the inspector how often they are heard of.
 */
import { Color, Group, Matrix4, Quaternion, Vector3 } from "three";
import { length, subtract, type Vec3 } from "../core/basics/geometry.ts";
import { EYE_HEIGHT_M } from "../core/basics/person.ts";
import type { Mover } from "../core/live/company.ts";
import { colourOf, Gait, isFar, type Pose, type Round } from "../core/live/crowd.ts";
import type { Worn } from "../core/live/events.ts";
import type { Eye } from "../core/strategy/sight.ts";
import { Discs, FarCrowd, NearCrowd, type Somebody } from "./crowds.ts";
import type { Person } from "./person.ts";
import { PersonCapture, pixelOf_m } from "./personcapture.ts";
import { keyOf, type Studio, Wardrobe } from "./wardrobe.ts";

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

/** All who wear no model. */
interface Crowd {
  readonly person: Person;
  readonly near: NearCrowd;
  readonly far: FarCrowd;
  /** The pictures of those who are far. */
  readonly capture: PersonCapture;
}

/** One of the people, as they were drawn last. */
interface Figure {
  readonly gait: Gait;
  readonly colour: Color;
  readonly world: Matrix4;
  far: boolean;
  /** Whether what it wears is drawn. */
  dressed: boolean;
  drawn: { readonly mover: Mover; readonly pose: Pose } | undefined;
}

export class Avatars {
  readonly root = new Group();
  private readonly figures = new Map<number, Figure>();
  private readonly discs = Discs.coloured(this.root);
  private readonly shades = Discs.shades(this.root);
  private readonly wardrobe: Wardrobe;
  private crowd: Crowd | undefined;
  private asked = false;
  /** Whether far people have their pictures. */
  private isCaptured = false;
  private lookedFrom: Vec3 | undefined;
  private rates = false;
  private stale = false;

  constructor(private readonly studio: Studio) {
    this.wardrobe = new Wardrobe(this.root, studio, () => {
      this.stale = true;
    });
  }

  /** Draws these people and no others; answers whether the picture has changed. */
  show(movers: readonly Mover[], look: Look): boolean {
    if (movers.length === 0 && this.figures.size === 0) return false;
    if (!this.crowd) {
      this.grow();
      return false;
    }
    const { person } = this.crowd;
    const present = new Set(movers.map(({ object }) => object));
    const gone = [...this.figures.keys()].filter((object) => !present.has(object));
    for (const object of gone) this.figures.delete(object);
    this.wardrobe.wear(new Set(movers.flatMap(({ worn }) => (worn ? keyOf(worn.impostor) : []))));
    let changed = gone.length > 0 || look.rates !== this.rates || this.stale;
    this.stale = false;
    for (const mover of movers) {
      const figure = this.figures.get(mover.object) ?? this.add(mover, person);
      const pose = figure.gait.step(mover.position, mover.orientation, look.now_ms);
      const distance_m = length(subtract(mover.position, look.eye.position));
      const far = isFar(distance_m, pixelOf_m(person), look.eye, TARGET_PX, figure.far);
      const dressed = mover.worn !== undefined && this.wardrobe.has(mover.worn.impostor);
      if (far === figure.far && dressed === figure.dressed && isAsDrawn(figure, mover, pose)) continue;
      place(figure, mover, dressed);
      figure.far = far;
      figure.dressed = dressed;
      figure.drawn = { mover, pose };
      changed = true;
    }
    this.rates = look.rates;
    if (changed) this.draw(this.crowd);
    this.turn(look.eye.position, changed);
    return changed;
  }

  /** Brings rules and what grows them, which who is alone does without; until then nobody is drawn. */
  private grow(): void {
    if (this.asked) return;
    this.asked = true;
    const grown = import("./person.ts").then(async ({ growPerson }) => {
      const person = growPerson();
      const capture = new PersonCapture(person);
      const near = new NearCrowd(person, this.root);
      const far = new FarCrowd(capture.impostor, capture.pictures, this.root);
      const all = [near.sample(), far.sample(), this.discs.sample(), this.shades.sample(), capture.sample()];
      await this.studio.prepare(new Group().add(...all));
      this.crowd = { person, near, far, capture };
    });
    grown.catch((error: unknown) => console.warn("people cannot be drawn", error));
  }

  private add({ object, worn }: Mover, person: Person): Figure {
    const { hue, saturation, lightness } = colourOf(object);
    const colour = new Color().setHSL(hue, saturation, lightness);
    const gait = new Gait(worn ? roundOf(worn) : person);
    const figure = { gait, colour, world: new Matrix4(), far: false, dressed: false, drawn: undefined };
    this.figures.set(object, figure);
    return figure;
  }

  private draw({ person, near, far, capture }: Crowd): void {
    const people: [Somebody[], Somebody[]] = [[], []];
    const wearers = new Map<string, Somebody[]>();
    const standing: Pose = { from: person.standing, to: person.standing, share: 0 };
    const discs: { world: Matrix4; colour: Color }[] = [];
    const afoot: Somebody[] = [];
    for (const { colour, world, far: isFarOff, dressed, drawn } of this.figures.values()) {
      if (!drawn) continue;
      const { worn } = drawn.mover;
      const somebody = { world, colour, pose: drawn.pose };
      if (worn && dressed) listed(wearers, keyOf(worn.impostor)).push(somebody);
      else people[isFarOff ? 1 : 0].push(worn ? { ...somebody, pose: standing } : somebody);
      if (!dressed) afoot.push(somebody);
      if (this.rates) discs.push({ world, colour: new Color(rateColour(drawn.mover.period_ms)) });
    }
    near.draw(people[0]);
    if (people[1].length > 0 && !this.isCaptured) {
      this.isCaptured = true;
      this.studio.paint(capture);
    }
    far.draw(people[1]);
    this.wardrobe.draw(wearers);
    this.discs.draw(discs);
    this.shades.draw(afoot);
  }

  /** Turns pictures to the eye. */
  private turn(eye: Vec3, changed: boolean): void {
    const moved = !this.lookedFrom || length(subtract(eye, this.lookedFrom)) > STEP_M;
    if (!moved && !changed) return;
    this.lookedFrom = eye;
    this.crowd?.far.look(eye);
    this.wardrobe.look(eye);
  }
}

/**
 * Green for ten times a second, over yellow, to red for once a second and less. With commas, since three takes what CSS writes without
 * them for white.
 */
export function rateColour(period_ms: number): string {
  const share = Math.min(1, Math.max(0, Math.log10(Math.max(period_ms, 1) / 100)));
  return `hsl(${Math.round(120 * (1 - share))}, 65%, 55%)`;
}

/** A model that is worn shows frames of its own; who stands shows the first. */
function roundOf({ impostor, scale }: Worn): Round {
  const stride_m = impostor.stride * Math.max(...scale) || 1;
  return { frames: impostor.frames, stride_m, standing: 0 };
}

function listed<T>(lists: Map<string, T[]>, key: string): T[] {
  const list = lists.get(key) ?? [];
  lists.set(key, list);
  return list;
}

/** A mover's position is that of its eyes, or of the origin of the model that it wears. */
function place({ world }: Figure, { position, orientation, worn }: Mover, dressed: boolean): void {
  const turn = new Quaternion(...orientation);
  if (worn && dressed) {
    world.compose(new Vector3(...position), turn, new Vector3(...worn.scale));
    return;
  }
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
