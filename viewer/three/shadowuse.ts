/**
 * Are shadows of the sun drawn here? Where a graphics card draws, and not on phones, which have little memory and grow warm; and not any
 * more where pictures take long although few pixels are drawn: they cost each pixel some looks at the shadow map.
 */

/** Whoever opens a page may say so; else it is found out. */
export type Wish = "on" | "off" | undefined;

/** Where one draws. */
export interface Machine {
  /** Whether a graphics card draws, and no processor. */
  readonly fast: boolean;
  /** Whether one points with a finger. */
  readonly coarse: boolean;
}

/** Shadows are given up where so small a share of the full width and height was drawn for so many moving pictures in a row. */
const [SMALL, PATIENCE] = [0.6, 90];

export class ShadowUse {
  private small = 0;

  /** `starts` says whether they are drawn to begin with. */
  private constructor(
    readonly starts: boolean,
    private readonly stays: boolean,
  ) {}

  static on(wish: Wish, { fast, coarse }: Machine): ShadowUse {
    return new ShadowUse(wish === undefined ? fast && !coarse : wish === "on", wish === "on");
  }

  /** Takes in with which share of the full width and height a moving picture is drawn; answers whether shadows are still drawn. */
  after(scale: number): boolean {
    if (this.small < PATIENCE) this.small = scale < SMALL ? this.small + 1 : 0;
    return this.starts && (this.stays || this.small < PATIENCE);
  }
}
