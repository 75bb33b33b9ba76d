/**
 * What do other people look like? A calm figure of two parts in a colour of its own, as tall as an eye is high above the
 * floor; a disc under its feet tells in the inspector how often it is heard of.
 */
import {
  CapsuleGeometry,
  CircleGeometry,
  Color,
  Group,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  type Object3D,
  SphereGeometry,
} from "three";
import type { Mover } from "../core/live/company.ts";

/** A mover's position is that of its eyes. */
const EYE_HEIGHT_M = 1.62;
const [BODY_RADIUS_M, BODY_M, HEAD_RADIUS_M] = [0.2, 1.04, 0.145];
/** A smaller step is not worth a new picture. */
const STEP_M = 1e-3;
/** Golden angle, so that ids next to each other have unlike colours. */
const HUE_STEP = 0.381966;

const BODY = new CapsuleGeometry(BODY_RADIUS_M, BODY_M, 6, 16);
const HEAD = new SphereGeometry(HEAD_RADIUS_M, 20, 14);
const NOSE = new SphereGeometry(0.035, 10, 8);
const DISC = new CircleGeometry(0.5, 32);

interface Figure {
  readonly root: Group;
  readonly cloth: MeshStandardMaterial;
  readonly skin: MeshStandardMaterial;
  readonly disc: Mesh<CircleGeometry, MeshBasicMaterial>;
}

export class Avatars {
  readonly root = new Group();
  private readonly figures = new Map<number, Figure>();

  /** Draws these people and no others, with discs when `rates` says so; answers whether the picture has changed. */
  show(movers: readonly Mover[], rates: boolean): boolean {
    const present = new Set(movers.map(({ object }) => object));
    const gone = [...this.figures.keys()].filter((object) => !present.has(object));
    for (const object of gone) this.remove(object);
    let changed = gone.length > 0;
    for (const mover of movers) {
      const figure = this.figures.get(mover.object) ?? this.add(mover);
      if (stands(figure, mover, rates)) continue;
      this.place(figure, mover, rates);
      changed = true;
    }
    return changed;
  }

  private add({ object, name }: Mover): Figure {
    const cloth = new MeshStandardMaterial({
      color: new Color().setHSL((object * HUE_STEP) % 1, 0.42, 0.5),
      roughness: 0.75,
    });
    const skin = new MeshStandardMaterial({ color: 0xe4cdb5, roughness: 0.8 });
    const disc = new Mesh(DISC, new MeshBasicMaterial({ transparent: true, opacity: 0.7, toneMapped: false }));
    const root = new Group();
    root.name = name || `o${object}`;
    root.add(
      at(new Mesh(BODY, cloth), -EYE_HEIGHT_M + BODY_RADIUS_M + BODY_M / 2, 0),
      at(new Mesh(HEAD, skin), 0, 0),
      at(new Mesh(NOSE, cloth), 0, -HEAD_RADIUS_M),
      at(disc, -EYE_HEIGHT_M + 0.03, 0),
    );
    root.position.set(Number.NaN, 0, 0);
    disc.rotation.x = -Math.PI / 2;
    const figure = { root, cloth, skin, disc };
    this.figures.set(object, figure);
    this.root.add(root);
    return figure;
  }

  private place({ root, disc }: Figure, { position, orientation, period_ms }: Mover, rates: boolean): void {
    root.position.set(...position);
    root.quaternion.set(...orientation);
    disc.visible = rates;
    disc.userData = { period_ms };
    if (rates) disc.material.color.set(rateColour(period_ms));
  }

  private remove(object: number): void {
    const figure = this.figures.get(object);
    if (!figure) return;
    figure.root.removeFromParent();
    for (const material of [figure.cloth, figure.skin, figure.disc.material]) material.dispose();
    this.figures.delete(object);
  }
}

/** Green for ten times a second, over yellow, to red for once a second and less. */
export function rateColour(period_ms: number): string {
  const share = Math.min(1, Math.max(0, Math.log10(Math.max(period_ms, 1) / 100)));
  return `hsl(${Math.round(120 * (1 - share))} 65% 55%)`;
}

/** Whether a figure stands where its mover is; a new one stands nowhere. */
function stands({ root, disc }: Figure, { position, orientation, period_ms }: Mover, rates: boolean): boolean {
  const near = Math.hypot(...position.map((x, i) => x - root.position.getComponent(i))) < STEP_M;
  const turned = orientation.some((q, i) => Math.abs(q - (root.quaternion.toArray()[i] ?? 0)) > STEP_M);
  const hue = disc.userData.period_ms === period_ms;
  return near && !turned && disc.visible === rates && (!rates || hue);
}

function at<T extends Object3D>(object: T, y: number, z: number): T {
  object.position.set(0, y, z);
  return object;
}
