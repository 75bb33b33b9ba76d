/** Where does one begin, and does the link by which one came lead into the world? */
import { type Bounds, length, subtract, type Vec3 } from "../core/basics/geometry.ts";
import type { Explorer } from "../core/explorer/explorer.ts";
import type { Pose } from "../core/movement/address.ts";
import { overview } from "../core/movement/overview.ts";
import type { Walker } from "../core/movement/walker.ts";
import type { VisitParts } from "./visit.ts";

export class Arrival {
  /** Where one has begun high up, if so. */
  private looksDownFrom: Vec3 | undefined;
  /** The place of a link that one has not left, while it is not known what is there. */
  private linked: Pose | undefined;

  constructor(
    private readonly parts: Pick<VisitParts, "scene" | "stage" | "isRoofed" | "frame" | "astray">,
    private readonly walker: Walker,
  ) {}

  /** What of the world belongs into a picture of all of it. */
  get framed(): Bounds {
    return this.parts.frame ?? this.parts.scene.manifest.bounds;
  }

  /** Begins high up with all of it in view; answers where, unless an author says another place, or a roof is above. */
  beginHigh(): Pose | undefined {
    const high = this.high();
    this.looksDownFrom = high?.position;
    return high;
  }

  /** Comes by a link, which may lead to where one begins high up. */
  comeBy(link: Pose): void {
    const high = this.high();
    if (high && link.mode === "fly" && this.isNear(high.position, link.position)) this.looksDownFrom = link.position;
    this.linked = link;
  }

  /** Whether one has not flown away from where one has begun high up. */
  get hasOnlyLooked(): boolean {
    return this.looksDownFrom !== undefined && this.isNear(this.walker.position, this.looksDownFrom);
  }

  /** Says so once it is known that a link leads nowhere, unless one has left that place. */
  judge(explorer: Explorer): void {
    const { linked, parts } = this;
    if (!linked) return;
    const judged = this.isNear(this.walker.position, linked.position) ? explorer.judge(linked) : "well";
    if (!judged) return;
    this.linked = undefined;
    if (judged !== "well") parts.astray?.(judged);
  }

  private high(): Pose | undefined {
    const { scene, stage, isRoofed } = this.parts;
    if (isRoofed) return undefined;
    const { width, height } = stage.size;
    return overview(scene.manifest, this.framed, stage.eye([0, 0, 0]).viewAngle_rad, width / Math.max(1, height));
  }

  private isNear(a: Vec3, b: Vec3): boolean {
    return length(subtract(a, b)) < this.walker.bodyRadius_m;
  }
}
